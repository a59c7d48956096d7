"""Measured samples: pairs of directions and the BRDF measured between them, always in 1/sr.

What was measured is declared and converted once, when the samples are made:

    brdf                  f                     [1/sr]
    brdf_cos              f cos theta_i         [1/sr], "BRDF times cosine"
    reflectance_factor    pi f                  [1], relative to a perfect white diffuser
"""

import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, TypedDict, Unpack

import torch
from torch import Tensor

from ..colour import RGB, of_spectrum
from ..errors import SamplesError, unknown_name
from ._checks import Numbers, Where, as_numbers, default_where, per_channel, per_sample, require, unit_directions

QUANTITIES: Final = ("brdf", "brdf_cos", "reflectance_factor")
ANGLE_UNITS: Final = ("degrees", "radians")


@dataclass(frozen=True)
class Masked:
    """Samples of a file that were left out: the reason, in words, and how many."""

    reason: str
    count: int


class SamplesKeywords(TypedDict, total=False):
    """What `Samples.from_angles` hands on to `Samples`."""

    channels: Iterable[str] | None
    sigma: Numbers | None
    quantity: str
    weight: Numbers | None
    cell: Numbers | None
    masked: Iterable[Masked]
    source: str
    format: str
    azimuth_observed: bool | None
    where: Where


@dataclass(frozen=True, init=False, repr=False, eq=False)
class Samples:
    """N measured samples in C channels, immutable; tensors are float64 on the CPU.

    wi, wo      (N, 3) unit vectors that leave the surface, z > 0. Lengths within 1e-4 of 1 are accepted and normalised.
    values      (N, C) or (N,), in the declared quantity; kept as the BRDF [1/sr]
    channels    C names; default ("value",), ("r", "g", "b"), else "c0" and so on
    sigma       standard deviation of values, shaped and declared as they are; kept in 1/sr
    weight      (N,) factor of the sample in every loss [1]
    cell        (N,) measure of the grid cell that the sample stands for [sr^2], where the file is a grid
    masked      what a reader left out, and why
    azimuth_observed    None derives it: wi's azimuth takes more than one value modulo 180 deg (spread above 1 deg,
                among theta_i > 1 deg). A format that knows better says so: half-angle tables turn wi about the
                half vector while the surface itself never turns.
    where       what an error calls a row (a reader names the line of its file)

    Raises SamplesError, naming the field and the first bad row, and UnknownNameError for the quantity.
    """

    wi: Tensor
    wo: Tensor
    values: Tensor
    channels: tuple[str, ...]
    sigma: Tensor | None
    quantity: str
    weight: Tensor | None
    cell: Tensor | None
    masked: tuple[Masked, ...]
    source: str
    format: str
    azimuth_declared: bool | None

    def __init__(
        self,
        wi: Numbers,
        wo: Numbers,
        values: Numbers,
        channels: Iterable[str] | None = None,
        sigma: Numbers | None = None,
        quantity: str = "brdf",
        *,
        weight: Numbers | None = None,
        cell: Numbers | None = None,
        masked: Iterable[Masked] = (),
        source: str = "",
        format: str = "",  # noqa: A002 - the name that read() and report() use too
        azimuth_observed: bool | None = None,
        where: Where = default_where,
    ) -> None:
        if quantity not in QUANTITIES:
            raise unknown_name("quantity", str(quantity), QUANTITIES, field="quantity")
        incident = unit_directions("wi", wi, where)
        count = len(incident)
        outgoing = unit_directions("wo", wo, where)
        if len(outgoing) != count:
            raise SamplesError(
                f"Expected wo to hold {count} directions as wi does, got {len(outgoing)}. Pass one pair a sample.",
                field="wo",
            )
        measured = per_channel("values", values, count)
        names = _channel_names(channels, measured.shape[1])
        advice = "Remove the sample, or leave its cell empty in a CSV file."
        require("values", measured.isfinite(), measured, "finite", advice, where, names)
        scale = _to_brdf(quantity, incident)
        f = measured * scale
        beyond = f"finite after conversion from {quantity} to the BRDF"
        require("values", f.isfinite(), measured, beyond, "Remove the sample.", where, names)
        deviation = None
        if sigma is not None:
            given = per_channel("sigma", sigma, count)
            if given.shape != measured.shape:
                raise SamplesError(
                    f"Expected sigma to be of shape {tuple(measured.shape)} as values are, got {tuple(given.shape)}. "
                    "Pass one standard deviation a value.",
                    field="sigma",
                )
            deviation = given * scale
            good = deviation.isfinite() & (deviation > 0)
            advice = "Give each value its standard deviation, or leave sigma out."
            require("sigma", good, given, "positive and finite", advice, where, names)
        fields = {
            "wi": incident,
            "wo": outgoing,
            "values": f,
            "channels": names,
            "sigma": deviation,
            "quantity": quantity,
            "weight": per_sample("weight", weight, count, where),
            "cell": per_sample("cell", cell, count, where),
            "masked": tuple(masked),
            "source": source,
            "format": format,
            "azimuth_declared": azimuth_observed,
        }
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    @classmethod
    def from_angles(
        cls,
        theta_i: Numbers,
        phi_i: Numbers,
        theta_o: Numbers,
        phi_o: Numbers,
        values: Numbers,
        unit: str | None = None,
        **keywords: Unpack[SamplesKeywords],
    ) -> "Samples":
        """Samples from polar angles in the declared unit, "degrees" or "radians"; single angles serve every sample.

        Both directions leave the surface, so the mirror direction of (theta, phi) is (theta, phi + 180 deg). A
        negative theta means the same tilt at phi + 180 deg, as in-plane data write it; |theta| < 90 deg.
        """
        if unit is None:
            raise SamplesError(
                'Expected unit to be declared, got nothing. Pass unit="degrees" or unit="radians".', field="unit"
            )
        if unit not in ANGLE_UNITS:
            raise unknown_name("unit", str(unit), ANGLE_UNITS, field="unit")
        where = keywords.get("where", default_where)
        given = {"theta_i": theta_i, "phi_i": phi_i, "theta_o": theta_o, "phi_o": phi_o}
        arrays = {name: _at_least_1d(as_numbers(name, angle)) for name, angle in given.items()}
        count = max(len(angle) for angle in arrays.values())
        for name, angle in arrays.items():
            if angle.ndim > 1 or len(angle) not in (1, count):
                raise SamplesError(
                    f"Expected {name} to be of shape ({count},) or one number, got {tuple(angle.shape)}. "
                    "Pass one angle a sample.",
                    field=name,
                )
            require(name, angle.isfinite(), angle, "finite", "Remove the sample or correct its angle.", where)
            arrays[name] = angle.expand(count)
        radians = {name: torch.deg2rad(a) if unit == "degrees" else a for name, a in arrays.items()}
        for name in ("theta_i", "theta_o"):
            limit = "90 degrees" if unit == "degrees" else "pi/2 radians"
            good = radians[name].abs() < math.pi / 2
            advice = "Remove the sample, or declare the right unit."
            require(name, good, arrays[name], f"above the horizon (|{name}| < {limit})", advice, where)
        wi = direction(radians["theta_i"], radians["phi_i"])
        wo = direction(radians["theta_o"], radians["phi_o"])
        return cls(wi, wo, values, **keywords)

    def subset(self, index: Tensor) -> "Samples":
        """The samples that a tensor of row numbers, or a boolean mask (N,), picks; what was masked stays on record."""
        if index.dtype == torch.bool and index.shape == (len(self),):
            rows = index.nonzero()[:, 0]
        elif (
            index.ndim == 1
            and not index.dtype.is_floating_point
            and not index.is_complex()
            and index.dtype != torch.bool
        ):
            rows = index.to(torch.int64)
        else:
            raise SamplesError(
                f"Expected index to be row numbers or a boolean mask of shape ({len(self)},), "
                f"got {index.dtype} of shape {tuple(index.shape)}. Pass a 1-D tensor of integers, or the mask.",
                field="index",
            )
        if len(rows) == 0:
            raise SamplesError(
                "Expected index to pick at least one sample, got none. Loosen the selection.", field="index"
            )
        if int(rows.min()) < -len(self) or int(rows.max()) >= len(self):
            raise SamplesError(
                f"Expected index to be within 0..{len(self) - 1}, got {int(rows.min())}..{int(rows.max())}. "
                "Pick rows that exist.",
                field="index",
            )
        fields = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return self._with({name: value[rows] for name, value in fields.items() if isinstance(value, Tensor)})

    def to_rgb(self) -> "Samples":
        """The samples in linear sRGB, channels r, g and b; as they are where these are the channels already.

        What the CIE 1931 observer sees of the spectrum under D65, a white being (1, 1, 1) (colour.py, also for what
        wavelengths do). sigma follows from independent errors. What sRGB does not hold is negative in a channel.
        Raises SamplesError where the channels are no spectrum by their names, or too little of one.
        """
        if self.channels == RGB:
            return self
        weights = of_spectrum(self.channels)
        sigma = None if self.sigma is None else (self.sigma.square() @ weights.square()).sqrt()
        return self._with({"values": self.values @ weights, "sigma": sigma, "channels": RGB})

    def _with(self, changed: Mapping[str, Any]) -> "Samples":
        """The same samples but for these fields, which are right already."""
        made = object.__new__(Samples)
        for name in self.__dataclass_fields__:
            object.__setattr__(made, name, changed[name] if name in changed else getattr(self, name))
        return made

    def __len__(self) -> int:
        return len(self.wi)

    def __repr__(self) -> str:
        source = f", from {self.source!r}" if self.source else ""
        return f"Samples({len(self)} samples, {len(self.channels)} channels, declared {self.quantity}{source})"

    @cached_property
    def hash(self) -> str:
        """The sha256 of all that a fit reads: directions, values, deviations, weights, cells and channel names."""
        arrays = {name: getattr(self, name) for name in ("wi", "wo", "values", "sigma", "weight", "cell")}
        digest = hashlib.sha256()
        for name, array in arrays.items():
            if array is not None:
                # -0.0 equals 0.0 and so hashes like it; little-endian on every machine
                digest.update(f"{name}{list(array.shape)}".encode())
                digest.update((array.numpy() + 0.0).astype("<f8").tobytes())
        digest.update(json.dumps(self.channels).encode())
        return f"sha256:{digest.hexdigest()}"

    @cached_property
    def azimuth_observed(self) -> bool:
        """Whether the sample was turned about its normal, so that its anisotropy can show in the data."""
        if self.azimuth_declared is not None:
            return self.azimuth_declared
        tilted = self.wi[self.wi[:, 2] < math.cos(math.radians(1.0))]
        if len(tilted) == 0:
            return False
        # twice the azimuth has period 360 deg; measured from the first sample, so that no wrap splits a cluster
        doubled = 2 * torch.atan2(tilted[:, 1], tilted[:, 0])
        turned = torch.remainder(doubled - doubled[0] + math.pi, 2 * math.pi) - math.pi
        return bool(turned.max() - turned.min() > 2 * math.radians(1.0))

    def report(self) -> dict[str, Any]:
        """What the samples are and what was left out, ready for JSON; angles in degrees, values in 1/sr."""
        ranges: dict[str, list[float]] = {}
        for side, w in (("i", self.wi), ("o", self.wo)):
            theta, phi = angles(w)
            ranges[f"theta_{side}_deg"] = _range(torch.rad2deg(theta))
            ranges[f"phi_{side}_deg"] = _range(torch.rad2deg(phi))
        return {
            "source": self.source,
            "format": self.format,
            "quantity": self.quantity,
            "samples": len(self),
            "channels": list(self.channels),
            **ranges,
            "azimuth_observed": self.azimuth_observed,
            "value_range": _range(self.values),
            "negative_values": int((self.values < 0).sum()),
            "zero_values": int((self.values == 0).sum()),
            "has_sigma": self.sigma is not None,
            "has_weight": self.weight is not None,
            "masked": [{"reason": masked.reason, "count": masked.count} for masked in self.masked],
        }


def direction(theta: Tensor, phi: Tensor) -> Tensor:
    """Unit vectors (N, 3) from polar angle and azimuth [rad]."""
    return torch.stack((theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()), -1)


def angles(w: Tensor) -> tuple[Tensor, Tensor]:
    """Polar angle and azimuth [rad] of unit vectors (N, 3); from atan2, so exact near the normal too."""
    # + 0.0 turns -0.0 into 0.0, whose azimuth is 180 deg and not -180
    return torch.atan2(torch.hypot(w[:, 0], w[:, 1]), w[:, 2]), torch.atan2(w[:, 1] + 0.0, w[:, 0])


def _at_least_1d(numbers: Tensor) -> Tensor:
    return numbers[None] if numbers.ndim == 0 else numbers


def _range(numbers: Tensor) -> list[float]:
    return [float(numbers.min()), float(numbers.max())]


def _to_brdf(quantity: str, wi: Tensor) -> Tensor:
    """The factor (N, 1) or (1, 1) that turns the declared quantity into the BRDF."""
    if quantity == "brdf_cos":
        return 1 / wi[:, 2:]
    return wi.new_full((1, 1), 1 / math.pi if quantity == "reflectance_factor" else 1.0)


def _channel_names(given: Iterable[str] | None, count: int) -> tuple[str, ...]:
    if given is None:
        return {1: ("value",), 3: ("r", "g", "b")}.get(count, tuple(f"c{k}" for k in range(count)))
    names = (given,) if isinstance(given, str) else tuple(given)
    if len(names) != count:
        raise SamplesError(
            f"Expected channels to be {count} names as values has {count} columns, got {len(names)}. "
            "Name each column once.",
            field="channels",
        )
    if not all(isinstance(name, str) and name for name in names) or len(set(names)) != count:
        raise SamplesError(
            f"Expected channels to be distinct, non-empty names, got {names!r}. Name each column once.",
            field="channels",
        )
    if not all(name.isprintable() for name in names):  # no JSON and no UTF-8 holds half of a surrogate pair
        raise SamplesError(
            f"Expected channels to be names that can be printed, got {names!r}. Name the columns in plain text.",
            field="channels",
        )
    return names
