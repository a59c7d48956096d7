"""Whether a material could exist: what it reflects at most, towards grazing, reciprocity, and the smallest value.

a(wo) = integral of f(wi, wo) cos theta_i dwi <= 1 for every wo,   f(wi, wo) = f(wo, wi),   f >= 0        [1]
"""

import math
import time
from dataclasses import dataclass
from typing import Any

import torch

from ..errors import InvalidValueError
from ..models._smith import SmithLobe
from ..models.material import Material, check_material
from .closed_forms import LOST_ERROR
from .peak import exceeding, highest, refined
from .probe import pairs, reciprocity
from .scan import LOWEST, STEEP, Lone, Scan, azimuth_of, lone_terms, theta_of

ROUNDING = 1e-9  # of a reciprocity error: f of narrow lobes has lost as much

ROUGH = 1e-2  # tolerance of the scan; what may be the largest is looked at again


@dataclass(frozen=True)
class Certificate:
    """What `certify` found. Angles are in radians here, in degrees in `to_dict` and in the sentences."""

    max_albedo: float  # the supremum of the directional albedo over angles, azimuths and channels [1]; may be infinite
    at_theta: float  # pi/2 where it is the limit towards grazing
    at_phi: float
    channel: int
    error: float  # claimed for max_albedo [1]; 0 where that is infinite
    grazing_limit: float  # of the albedo, the largest over azimuths and channels [1]; infinite where it diverges
    grazing_exponent: float  # e of albedo ~ (cos theta)^-e; 0 where there is a limit
    exceeds: tuple[float, float] | None  # the first and the last theta at which the albedo exceeds 1, within 0.1 %
    largest_before: float  # the largest albedo up to cos theta = 1e-12 [1], for one that diverges
    reciprocity_error: float  # the largest |f(wi, wo) - f(wo, wi)| as a share of the larger, over seeded directions [1]
    min_value: float  # the smallest f over those directions [1/sr]
    pairs: int  # of those directions
    tolerance: float
    isotropic: bool  # no albedo depends on the azimuth
    channels: int
    evaluations: int
    seconds: float
    channel_names: tuple[str, ...] = ()  # for the sentences; a material itself has none
    allowed: float = 0.0  # by which compensated lobes may exceed 1: the error of the table that they read [1]

    @property
    def energy_conserving(self) -> bool:
        """Whether the largest albedo is at most 1 + tolerance, with what its claimed error has beyond the tolerance.

        A compensated lobe returns what a table says that it loses, so the table's own error is allowed for.
        """
        return self.max_albedo + max(self.error - self.tolerance, 0.0) <= 1 + self.tolerance + self.allowed

    @property
    def decided(self) -> bool:
        """Whether the claimed error leaves no doubt of `energy_conserving`."""
        return self.energy_conserving or self.max_albedo - self.error > 1

    @property
    def reciprocal(self) -> bool:
        """Whether exchanging the directions changes f by rounding only."""
        return self.reciprocity_error <= ROUNDING

    @property
    def verdict(self) -> str:
        """The finding in one plain sentence, and a second one where the material is not reciprocal."""
        return " ".join([_energy(self), *([] if self.reciprocal else [_exchange(self)])])

    @property
    def place(self) -> str:
        """Where the largest albedo is, in words."""
        name = self.channel_names[self.channel] if self.channel_names else f"{self.channel + 1} of {self.channels}"
        channel = f" in channel {name}" if self.channels > 1 else ""
        if self.at_theta == 0:
            return f"at normal incidence{channel}"
        limit = self.at_theta == math.pi / 2
        where = "in the limit towards grazing" if limit else f"at {_degrees(self.at_theta)} degrees"
        azimuth = "" if self.isotropic else f" and azimuth {math.degrees(self.at_phi):.3g}"
        return f"{where}{azimuth}{channel}"

    @property
    def power(self) -> str:
        """The power of the cosine by which the albedo grows towards grazing, where it has no limit."""
        return "cos theta" if self.grazing_exponent == 1 else f"cos^{self.grazing_exponent:.3g} theta"

    def to_dict(self) -> dict[str, Any]:
        """The certificate as JSON-able data, angles in degrees, null for what is infinite."""
        return {
            "verdict": self.verdict,
            "energy_conserving": self.energy_conserving,
            "decided": self.decided,
            "max_albedo": _finite(self.max_albedo),
            "error": _finite(self.error),
            "at_theta_deg": math.degrees(self.at_theta),
            "at_phi_deg": math.degrees(self.at_phi),
            "channel": self.channel,
            "grazing_limit": _finite(self.grazing_limit),
            "grazing_exponent": self.grazing_exponent,
            "exceeds_deg": None if self.exceeds is None else [math.degrees(theta) for theta in self.exceeds],
            "largest_before": _finite(self.largest_before),
            "reciprocal": self.reciprocal,
            "reciprocity_error": self.reciprocity_error,
            "min_value": self.min_value,
            "pairs": self.pairs,
            "tolerance": self.tolerance,
            "allowed": self.allowed,
            "evaluations": self.evaluations,
            "seconds": self.seconds,
        }


def certify(material: Material, tolerance: float = 1e-6) -> Certificate:
    """The certificate of a material, its largest albedo a claimed to tolerance * max(1, a) [1] where that can be met.

    Every term is integrated alone, over as many azimuths as its symmetry leaves to see. Raises InvalidValueError for
    what is no material, and for a tolerance that is not in (0, 0.1].
    """
    begun = time.perf_counter()
    check_material(material)
    if not 0 < tolerance <= 0.1:
        raise InvalidValueError(
            f"Expected tolerance to be in (0, 0.1], got {tolerance}. Leave it out for 1e-6.", field="tolerance"
        )
    with torch.no_grad():
        values = {key: value.detach().double().cpu() for key, value in material.values().items()}
        scan = Scan(lone_terms(material.form, values), material.channels)
        total, claimed = (part.sum(0) for part in scan.rows(scan.u, ROUGH))
        exponents = scan.exponents()
        if bool((exponents > 0).any()):
            fastest = torch.where((exponents == exponents.max()).any(0), total[-1:], -1.0)
            top = highest(scan, total)
            limit = highest(scan, fastest)._replace(albedo=math.inf, error=0.0)
        elif not bool(total.isfinite().all()):
            top = highest(scan, total)._replace(error=0.0)
            limit = highest(scan, total[-1:])
        else:
            top, limit = refined(scan, total, claimed, tolerance)
        doubt = top.error if top.u < STEEP else -tolerance  # what is as good as at the horizon is the limit's
        at_limit = math.isinf(limit.albedo) or limit.albedo > top.albedo + doubt
        found = limit if at_limit else top
        allowed = sum(LOST_ERROR * lone.reflectance for lone in scan.terms if _compensated(lone))
        more = tolerance + allowed
        exceeds = exceeding(scan, total, top, more) if found.albedo > 1 + more else None
        exchanged, smallest = reciprocity(material.form, values)
    return Certificate(
        max_albedo=found.albedo,
        at_theta=math.pi / 2 if at_limit else theta_of(found.u),
        at_phi=float(azimuth_of(torch.tensor(found.s))),
        channel=found.channel,
        error=found.error,
        grazing_limit=limit.albedo,
        grazing_exponent=float(exponents.max()),
        exceeds=exceeds,
        largest_before=max(top.albedo, float(total.max())),
        reciprocity_error=exchanged,
        min_value=smallest,
        pairs=len(pairs().wi),
        tolerance=tolerance,
        isotropic=scan.turn == 0,
        channels=material.channels,
        evaluations=scan.evaluations,
        seconds=time.perf_counter() - begun,
        allowed=allowed,
    )


def _compensated(lone: Lone) -> bool:
    """Whether the term returns what a table says that it loses."""
    model = lone.form.terms[0].model
    return isinstance(model, SmithLobe) and model.compensated


def _finite(x: float) -> float | None:
    return x if math.isfinite(x) else None


def _energy(it: Certificate) -> str:
    """What the albedo does."""
    if it.exceeds is None:
        if it.max_albedo == 0:
            return "Conserves energy: it reflects nothing."
        if it.energy_conserving:
            return f"Conserves energy: the largest albedo is {it.max_albedo:.4g}, {it.place}."
        return f"Not decided: the largest albedo is {it.max_albedo:.4g} to within {it.error:.1g}, {it.place}."
    if it.grazing_exponent == 0:
        largest = f"{it.max_albedo:.4g}, {it.place}" if math.isfinite(it.max_albedo) else "more than 1e308"
        return f"Reflects more than it receives {_range(*it.exceeds)}: the largest albedo is {largest}."
    grows = f"the albedo grows like 1/{it.power} and has no limit"
    if it.exceeds[0] < math.pi / 2:
        return f"Reflects more than it receives {_range(*it.exceeds)}: {grows}."
    return (
        f"Reflects more than it receives in the limit towards grazing only: {grows}, but it is at most "
        f"{it.largest_before:.3g} up to {math.degrees(LOWEST):.0e} degrees from the horizon."
    )


def _exchange(it: Certificate) -> str:
    return f"Not reciprocal: exchanging the directions changes f by up to {100 * it.reciprocity_error:.3g} %."


def _range(first: float, last: float) -> str:
    """The angles at which the albedo exceeds 1, which at its ends need not be all between them."""
    beyond = math.degrees(math.pi / 2 - first)
    if last == math.pi / 2:
        if first == 0:
            return "already at normal incidence"
        return f"beyond {_degrees(first)} degrees" if beyond > 1e-6 else f"within {beyond:.1g} degrees of the horizon"
    return (
        f"up to {_degrees(last)} degrees" if first == 0 else f"between {_degrees(first)} and {_degrees(last)} degrees"
    )


def _degrees(theta: float) -> str:
    """An angle [degrees] with as many digits as tell it from 90."""
    angle = math.degrees(theta)
    return f"{angle:.{max(1, math.ceil(-math.log10(max(90 - angle, 1e-12))))}f}"
