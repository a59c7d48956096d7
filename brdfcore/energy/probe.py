"""What a material's values tell without an integral: reciprocity, the smallest value, symmetry, growth at grazing.

The directions are the same for every material. Half of the pairs are uniform on the hemisphere; half are mirrored at
half vectors whose slopes are spread evenly over ten decades, so that lobes of every width are met. Every second wo
has a height spread evenly over six decades, so that grazing angles are.
"""

import functools
import math
from typing import NamedTuple

import torch
from torch import Tensor

from ..geometry import geometry, reflect
from ..models.form import Form
from ..parameters import Values

DRAWN = 1024  # pairs; a sixth of them, with wi below the horizon, is dropped
SEED = 20100629
SLOPES = (-9.0, 1.0)  # powers of ten
HEIGHT = -6.0  # of the lowest direction
NEGLIGIBLE = 1e-200  # [1/sr]: below it the exponential has lost its digits, and no energy is carried
SAME = 1e-8  # relative; turning a pair that is 1e-2 above the horizon changes a value by rounding, 1e-10 at most
LOW = (1e-20, 1e-40)  # heights of wo between which the growth of f is measured
ALIKE = 1e-9  # by which exponents may differ and still be one power of the height


class Pairs(NamedTuple):
    """Pairs of directions, (N, 3) each, above the horizon."""

    wi: Tensor
    wo: Tensor


class Symmetry(NamedTuple):
    """How a value depends on the azimuth of the sample."""

    isotropic: bool  # it does not change when wi and wo turn about the normal together
    mirrored: bool  # nor when both are mirrored in the plane x = 0, or in y = 0


def _raised(height: Tensor, azimuth: Tensor) -> Tensor:
    """Unit vectors (..., 3) of a height in (0, 1] and an azimuth."""
    side = torch.sqrt((1 - height) * (1 + height))
    return torch.cat([side * torch.cos(azimuth), side * torch.sin(azimuth), height], dim=-1)


@functools.cache
def pairs() -> Pairs:
    """The seeded pairs."""
    generator = torch.Generator().manual_seed(SEED)
    u = torch.rand(6, DRAWN, 1, dtype=torch.float64, generator=generator)
    turn = 2 * math.pi * u
    number = torch.arange(DRAWN).unsqueeze(-1)
    wo = _raised(torch.where(number % 2 == 0, u[0], 10 ** (HEIGHT * u[0])), turn[1])
    slope = 10 ** (SLOPES[0] + (SLOPES[1] - SLOPES[0]) * u[2])
    mirrored = reflect(wo, slope * torch.cos(turn[3]), slope * torch.sin(turn[3]))
    wi = torch.where(number % 4 < 2, _raised(u[4], turn[5]), mirrored)
    above = wi[:, 2] > 0
    return Pairs(wi[above], wo[above])


@functools.cache
def grazing_pairs() -> tuple[Pairs, Pairs]:
    """Pairs of the same wi, seen along the x axis and along others from two heights that are as good as 0."""
    generator = torch.Generator().manual_seed(SEED)
    u = torch.rand(3, DRAWN // 4, 1, dtype=torch.float64, generator=generator)
    azimuth, slope, turn = 2 * math.pi * u[0], 10 ** (SLOPES[0] + (SLOPES[1] - SLOPES[0]) * u[1]), math.pi * u[2]
    level = _raised(torch.zeros_like(azimuth), azimuth)
    # half vectors that lean towards wo, whose wi is above the horizon
    c, s = torch.cos(azimuth), torch.sin(azimuth)
    along, across = slope * torch.sin(turn), slope * torch.cos(turn)
    wi = reflect(level, c * along - s * across, s * along + c * across)
    first, second = (Pairs(wi, _raised(torch.full_like(azimuth, low), azimuth)) for low in LOW)
    return first, second


def value(form: Form, values: Values, wi: Tensor, wo: Tensor) -> Tensor:
    """The BRDF [1/sr], (N, C) or (N, 1), for values in double precision."""
    f = form.f(values, geometry(wi, wo, form.needs))
    return f.expand(len(wi), -1)


def reciprocity(form: Form, values: Values) -> tuple[float, float]:
    """The largest |f(wi, wo) - f(wo, wi)| as a share of the larger [1], and the smallest f [1/sr], over the pairs."""
    wi, wo = pairs()
    f, g = value(form, values, wi, wo), value(form, values, wo, wi)
    larger = torch.maximum(f, g)
    counted = larger > NEGLIGIBLE
    error = torch.where(counted, (f - g).abs() / torch.where(counted, larger, 1.0), 0.0)
    return float(error.max()), float(torch.minimum(f, g).min())


def symmetry(form: Form, values: Values) -> Symmetry:
    """Which turns and mirrors of the sample leave f as it is."""
    wi, wo = pairs()
    high = (wi[:, 2] > 1e-2) & (wo[:, 2] > 1e-2)
    wi, wo = wi[high], wo[high]
    f = value(form, values, wi, wo)

    def unchanged(*rows: list[float]) -> bool:
        matrix = wi.new_tensor(rows)
        moved = value(form, values, wi @ matrix, wo @ matrix)
        larger = torch.maximum(f, moved)
        return not bool(((larger > NEGLIGIBLE) & ((f - moved).abs() > SAME * larger)).any())

    c, s = math.cos(1.0), math.sin(1.0)  # no model's symmetry has an angle of one radian
    if unchanged([c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]):
        return Symmetry(isotropic=True, mirrored=True)
    mirrored = unchanged([-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
    return Symmetry(False, mirrored and unchanged([1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]))


def growth(form: Form, values: Values) -> float | None:
    """The exponent e of f ~ (cos theta_o)^-e towards grazing wo for a fixed wi; None where f is no such power."""
    (wi, high), (_, low) = grazing_pairs()
    f, g = value(form, values, wi, high), value(form, values, wi, low)
    lit = (f > NEGLIGIBLE) & (g > NEGLIGIBLE) & (torch.maximum(f, g) < 1e200)
    if not bool(lit.any()):
        return None
    exponent = torch.log(g[lit] / f[lit]) / math.log(LOW[0] / LOW[1])
    if bool(exponent.max() - exponent.min() > ALIKE):
        return None
    middle = float(exponent.median())
    return middle if abs(middle) > ALIKE else 0.0
