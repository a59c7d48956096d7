"""The axes of a table of albedos, each with a coordinate in which the albedo is smooth.

    theta   t = (1 - theta / (pi/2))^(1/3)           even steps of t lie close together towards grazing
    phi     t = cos 2 phi',  tan phi' = tan phi / stretch,  stretch = sqrt(ax/ay)
    log     t = ln value          where the parameter is one that is searched on a logarithmic scale
    linear  t = value

A lobe's albedo changes with theta where the horizon begins to cut it, at a height of about its width, and with the
azimuth where a long lobe turns its narrow side. The cube root makes 20 to 60 nodes serve widths from 1 to 1e-3, and the
stretch 10 azimuths where 50 to 90 would be needed. Every model is symmetric about the planes x = 0 and y = 0, so one
quadrant holds all azimuths (tests/energy/test_tables.py).
"""

import math
from dataclasses import dataclass
from typing import Literal

import torch
from torch import Tensor

from ..errors import InvalidValueError, unknown_name
from ..models.form import Form
from ..parameters import Values
from . import _chebyshev

LOWEST = 1e-12  # the height [rad] at which an axis without an end ends: the albedo there is that of the horizon
_WIDTH_POWER = {False: 0.5, True: -0.25}  # of the ratio x/y, for widths and for exponents n = 2 / width^2


@dataclass(frozen=True)
class Axis:
    """One axis: its name, its range [rad, or the parameter's unit] and what its coordinate is."""

    name: str
    low: float
    high: float
    coordinate: Literal["theta", "phi", "log", "linear"]

    def t(self, value: Tensor) -> Tensor:
        """The coordinate of a value; of phi, the value is phi'."""
        match self.coordinate:
            case "theta":
                return (1 - value / (math.pi / 2)).clamp(min=LOWEST / (math.pi / 2)) ** (1 / 3)
            case "phi":
                return torch.cos(2 * value)
            case "log":
                return torch.log(value)
            case "linear":
                return value

    @property
    def ends(self) -> tuple[float, float]:
        """The coordinates of `low` and `high`."""
        low, high = self.t(torch.tensor([self.low, self.high], dtype=torch.float64)).tolist()
        return low, high

    def x(self, value: Tensor) -> Tensor:
        """The place of a value in [-1, 1], from 1 at `low` to -1 at `high`; beyond the ends it is the end's."""
        low, high = self.ends
        return (2 * (self.t(value) - high) / (low - high) - 1).clamp(-1, 1)

    def values(self, x: Tensor) -> Tensor:
        """The values at places in [-1, 1]; of phi, phi'. The ends come out exactly."""
        low, high = self.ends
        t = high + (low - high) * (x + 1) / 2
        match self.coordinate:
            case "theta":
                found = math.pi / 2 * (1 - t**3)
            case "phi":
                found = torch.acos(t.clamp(-1, 1)) / 2
            case "log":
                found = torch.exp(t)
            case "linear":
                found = t
        return torch.where(x == 1, self.low, torch.where(x == -1, self.high, found.clamp(self.low, self.high)))

    def nodes(self, count: int) -> Tensor:
        """The values at `count` nodes, from `low` to `high`, (count,)."""
        return self.values(_chebyshev.nodes(count))


@dataclass(frozen=True)
class Ratio:
    """A factor (above / below)^power of the stretch, of two parameters' values."""

    above: str
    below: str
    power: float


def ratios(form: Form) -> tuple[Ratio, ...]:
    """What the azimuth's stretch is made of: each lobe with two widths, at equal parts."""
    terms = [term for term in form.terms if len(getattr(term.model, "width_names", ())) == 2]
    found = []
    for term in terms:
        along_x, along_y = (f"{term.label}.{name}" for name in term.model.width_names)  # type: ignore[attr-defined]
        is_exponent = term.model.widths_along[0] == "n"  # type: ignore[attr-defined]
        found.append(Ratio(along_x, along_y, _WIDTH_POWER[is_exponent] / len(terms)))
    return tuple(found)


def stretch(parts: tuple[Ratio, ...], form: Form, values: Values) -> Tensor:
    """The stretch of the azimuth [1], shaped as the widths' values are."""
    product = torch.ones((), dtype=torch.float64)
    for part in parts:
        above, below = form.resolve(part.above, values), form.resolve(part.below, values)
        product = product * (above / below) ** part.power
    return product


def turned(phi: Tensor, factor: Tensor) -> Tensor:
    """The azimuth phi' in [0, pi/2] with tan phi' = |tan phi| / factor [rad]; differentiable but at the planes."""
    return torch.atan2(torch.sin(phi).abs(), torch.cos(phi).abs() * factor)


def of_parameter(form: Form, key: str, asked: tuple[float, float] | None) -> Axis:
    """The axis of a parameter over a range, by default the one that fits search."""
    if key not in form.parameters:
        raise unknown_name("an axis", key, ["theta", *form.parameters], field="axes")
    parameter = form.parameters[key]
    box = [float(end) for end in form.bounds(key, torch.zeros((), dtype=torch.float64))]
    low, high = _pair(key, asked) if asked is not None else parameter.search_range
    if asked is None:
        low, high = max(low, box[0]), min(high, box[1])
    if not box[0] <= low < high <= box[1]:
        raise InvalidValueError(
            f"Expected the axis {key} to be a range within [{box[0]:g}, {box[1]:g}], got ({low:g}, {high:g}). "
            f"It is the {parameter.description}; give its lowest and its highest value.",
            field="axes",
        )
    return Axis(key, low, high, parameter.scale)


def of_theta(asked: tuple[float, float] | None) -> Axis:
    """The axis of the polar angle, by default from the normal to the horizon."""
    low, high = _pair("theta", asked) if asked is not None else (0.0, math.pi / 2)
    if not 0 <= low < high <= math.pi / 2:
        raise InvalidValueError(
            f"Expected the axis theta to be a range within [0, pi/2], got ({low:g}, {high:g}). Angles are in radians.",
            field="axes",
        )
    return Axis("theta", low, high, "theta")


PHI = Axis("phi", 0.0, math.pi / 2, "phi")


def _pair(name: str, asked: object) -> tuple[float, float]:
    """The two numbers of a range."""
    match asked:
        case (int() | float() as low, int() | float() as high):
            return float(low), float(high)
    raise InvalidValueError(
        f"Expected the axis {name} to be two numbers or None, got {asked!r}. Give its lowest and its highest value.",
        field="axes",
    )
