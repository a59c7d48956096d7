"""How a fit predicts incidences that it did not see: each is left out in turn, and the rest fitted again.

A model that only bends to its samples predicts the others badly; noise alone makes both errors equal. A refit starts
from the fit and from a scan, so this costs as much as a fit for each angle or band (at most six).
"""

from dataclasses import dataclass, replace

from ..errors import SamplesError
from ..models.material import Material
from .incidences import incidences
from .result import Fit
from .search import search
from .worth import errors


@dataclass(frozen=True)
class HeldOut:
    """Errors at some angles of incidence, the roots of the mean squares of f cos theta_i [1/sr]."""

    low_deg: float
    high_deg: float
    samples: int
    seen: float  # of the fit to all samples
    unseen: float  # of the fit to the others


def held_out(fit: Fit) -> tuple[HeldOut, ...]:
    """The errors by incidence of the fit and of fits without it; SamplesError where there is one incidence."""
    groups = incidences(fit.samples)
    if len(groups) < 2:
        raise SamplesError(
            f"Expected samples at two or more angles of incidence, got {groups[0].low:g} degrees alone. Measure at "
            "others.",
            field="samples",
        )
    plan = replace(fit.plan, starts=(fit.values, *fit.plan.starts))
    found: list[HeldOut] = []
    for group in groups:
        here, rest = fit.samples.subset(group.chosen), fit.samples.subset(~group.chosen)
        ends = search(plan, [rest], fit.loss, "auto", int(fit.provenance["seed"]), lambda *_: None)
        other = Material(fit.form, ends.problem.unpack(ends.outcome.x[0]))
        seen, unseen = (errors(material, here)["cosine_rms"] for material in (fit.material, other))
        found.append(HeldOut(group.low, group.high, len(here), seen, unseen))
    return tuple(found)
