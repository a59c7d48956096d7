"""The largest value of each model's bases times cos theta_o over pieces of directions, from intervals.

    E (1 + e2)^n            log-concave in (p^2, q^2): its largest value on a rectangle has a closed form
    co^(1 - a) / (ci + co)  and its relatives have one peak in co, so theirs has one too
    F, 1 - F                monotone in h.wo (Schlick), or interval arithmetic on Fresnel's formulas

1/(h.wo) is 2 / ((ci + co) sqrt(1 + e2)), so no factor is bounded apart from those it moves with.
"""

import math
from collections.abc import Callable
from typing import cast

import torch
from torch import Tensor

from ..models import Model
from ..models._gaussian_slopes import GaussianSlopes
from ..models._half_vector import HalfVectorLobe
from ..models.fresnel import one_minus_fifth_power, schlick
from ..parameters import Values
from .pieces import Pieces, nearest


def slopes_peak(model: Model, values: Values, pieces: Pieces, power: float) -> Tensor:
    """The largest E (1 + e2)^power / (pi ax ay) [1], (rows, pieces, 1)."""
    wx, wy = cast(GaussianSlopes, model).widths(values)
    x, y = pieces.p2, pieces.q2
    if bool(wx < wy):  # along the wider slope first: there E falls less while 1 + e2 grows as much
        x, y, wx, wy = y, x, wy, wx
    p2 = nearest(power * wx.square() - 1 - y[0], x)
    q2 = nearest(power * wy.square() - 1 - p2, y)
    exponent, growth = p2 / wx.square() + q2 / wy.square(), power * torch.log1p(p2 + q2)
    return torch.exp(growth - exponent + 8 * pieces.eps * (exponent + growth)) / (math.pi * wx * wy)


def _over_larger(pieces: Pieces) -> Tensor:
    """The largest co / (max(ci, co) (ci + co)), which rises up to co = ci and falls from there."""
    co = nearest(pieces.ci, pieces.co)
    return (co / pieces.ci).clamp(max=1) / (pieces.ci + co)


def _with_fresnel(model: Model, values: Values, lobe: Tensor, pieces: Pieces) -> tuple[Tensor, ...]:
    """The lobe under the Fresnel factor that the options choose, (rows, pieces, 1) each."""
    if "schlick" in model.options or "scaled" in model.options:
        return lobe, lobe * schlick(pieces.h_dot_wo[0].clamp(max=1))
    return (lobe,)


def _lambert(model: Model, values: Values, pieces: Pieces) -> tuple[Tensor, ...]:
    return (pieces.co[1] / math.pi,)


def _coupled_lambert(model: Model, values: Values, pieces: Pieces) -> tuple[Tensor, ...]:
    return (one_minus_fifth_power(pieces.h_dot_wo[1]) * pieces.co[1] / math.pi,)


def _ashikhmin_shirley_diffuse(model: Model, values: Values, pieces: Pieces) -> tuple[Tensor, ...]:
    ci, co = pieces.ci, pieces.co[1]
    half = one_minus_fifth_power(0.5 * ci) * one_minus_fifth_power(0.5 * co)
    return (28 / (23 * math.pi) * half * co,)


def _ward(model: Model, values: Values, pieces: Pieces) -> tuple[Tensor, ...]:
    return (0.25 * slopes_peak(model, values, pieces, 0) * torch.sqrt(pieces.co[1]) / torch.sqrt(pieces.ci),)


def _ward_duer(model: Model, values: Values, pieces: Pieces) -> tuple[Tensor, ...]:
    return (0.25 * slopes_peak(model, values, pieces, 0) / pieces.ci,)


def _ward_neumann(model: Model, values: Values, pieces: Pieces) -> tuple[Tensor, ...]:
    return (0.25 * slopes_peak(model, values, pieces, 0) * (pieces.co[1] / pieces.ci).clamp(max=1),)


def _ward_bounded(model: Model, values: Values, pieces: Pieces) -> tuple[Tensor, ...]:
    ci = pieces.ci
    co = nearest(ci, pieces.co)  # where co / (ci + co)^2 is largest
    return (slopes_peak(model, values, pieces, 1) * (co / (ci + co)) / (ci + co),)


def _kurt(model: Model, values: Values, pieces: Pieces) -> tuple[Tensor, ...]:
    """With 1/(h.wo) = 2 / ((ci + co) sqrt(1 + e2)): E (1 + e2)^(3/2) (ci co)^-alpha co / (2 pi mx my (ci + co))."""
    ci, alpha = pieces.ci, values["alpha"]
    co = nearest((1 - alpha) / alpha * ci, pieces.co)  # where co^(1 - alpha) / (ci + co) is largest
    shadowing = co / (ci + co) / (ci * co) ** alpha
    return _with_fresnel(model, values, 0.5 * slopes_peak(model, values, pieces, 1.5) * shadowing, pieces)


def _kurt_plausible(model: Model, values: Values, pieces: Pieces) -> tuple[Tensor, ...]:
    return _with_fresnel(model, values, 0.5 * slopes_peak(model, values, pieces, 1.5) * _over_larger(pieces), pieces)


def _ashikhmin_shirley(model: Model, values: Values, pieces: Pieces) -> tuple[Tensor, ...]:
    """With hz = (1 + e2)^(-1/2) and 1/(h.wo) as above."""
    nu, nv = cast(HalfVectorLobe, model).widths(values)
    p2, q2 = pieces.p2, pieces.q2
    low, high = p2[0] + q2[0], p2[1] + q2[1]
    high = high.clamp(min=torch.finfo(high.dtype).tiny)
    # (nu p^2 + nv q^2) log(1 + e2) / e2 from below: log(1 + e2) / e2 falls, and its factor is at least min(nu, nv) e2
    by_slopes = (nu * p2[0] + nv * q2[0]) * (torch.log1p(high) / high)
    exponent = torch.maximum(by_slopes, torch.minimum(nu, nv) * torch.log1p(low))
    height = torch.exp((8 * pieces.eps - 1) * 0.5 * (exponent + torch.log1p(low)))
    lobe = torch.sqrt((nu + 1) * (nv + 1)) / (4 * math.pi) * height * _over_larger(pieces)
    return _with_fresnel(model, values, lobe, pieces)


# The largest of each basis times cos theta_o over pieces, (rows, pieces, 1) or (rows, pieces, C) each.
BOUNDS: dict[str, Callable[[Model, Values, Pieces], tuple[Tensor, ...]]] = {
    "lambert": _lambert,
    "coupled_lambert": _coupled_lambert,
    "ashikhmin_shirley_diffuse": _ashikhmin_shirley_diffuse,
    "ward": _ward,
    "ward_duer": _ward_duer,
    "ward_neumann": _ward_neumann,
    "ward_bounded": _ward_bounded,
    "ashikhmin_shirley": _ashikhmin_shirley,
    "kurt": _kurt,
    "kurt_plausible": _kurt_plausible,
}
OPTIONS = frozenset({"isotropic", "anisotropic", "schlick", "scaled", "constant"})
