"""Directional albedos that have an exact form, basis by basis [1].

lambert: 1. ashikhmin_shirley_diffuse: 1 - (1 - co/2)^5 (techreport eqs. 12, 15). oren_nayar, qualitative:
A + B/pi (s (theta - s c) + 2/3 tan theta (1 - s^3)) with s = sin theta_o, c = cos theta_o; energy-preserving: E for the
first reflection and 1 - E for the others (Portsmouth, Kutz and Hill 2025, with Oren and Nayar's A and B 1994).
What a compensated microfacet lobe returns: F_back G(co) (Kulla and Conty 2017).
"""

import math
from collections.abc import Callable

import torch
from torch import Tensor

from ..models import Model
from ..models._compensation import MEAN_ERROR, across, pieces
from ..models._smith import SmithLobe
from ..models.fresnel import one_minus_fifth_power
from ..models.oren_nayar import _C1, _lost
from ..parameters import Values
from .rules import gauss

ORDER, HALVINGS = 16, 60  # of the quadrature of a spline's mean: nodes of a cell, and steps that find the cells' ends
LOST_ERROR = 4e-5  # of a table of lost energy over its whole box [1]: what a compensated lobe may return too much
MEAN_PRECISE = 1e-14  # of that mean, as a share of it

Exact = Callable[[Model, Values, Tensor], tuple[Tensor, ...]]


def _lambert(model: Model, own: Values, co: Tensor) -> tuple[Tensor, ...]:
    return (torch.ones_like(co),)


def _ashikhmin_shirley_diffuse(model: Model, own: Values, co: Tensor) -> tuple[Tensor, ...]:
    return (one_minus_fifth_power(co / 2),)


def _oren_nayar(model: Model, own: Values, co: Tensor) -> tuple[Tensor, ...]:
    sigma = own["sigma"]
    if "energy_preserving" in model.options:
        r = 2 / math.pi * sigma
        further = r * _lost(co) / (math.pi * (1 + _C1 * r))
        return 1 - further, further
    sigma2 = sigma.square()
    a, b = 1 - 0.5 * sigma2 / (sigma2 + 0.33), 0.45 * sigma2 / (sigma2 + 0.09)
    sine = torch.sqrt((1 - co) * (1 + co))
    # tan theta (1 - s^3) = s c (1 + s + s^2) / (1 + s): nothing is lost towards grazing
    rise = sine * (torch.atan2(sine, co) - sine * co) + 2 / 3 * sine * co * (1 + sine + sine.square()) / (1 + sine)
    return (a + b / math.pi * rise,)


EXACT: dict[str, Exact] = {
    "lambert": _lambert,
    "ashikhmin_shirley_diffuse": _ashikhmin_shirley_diffuse,
    "oren_nayar": _oren_nayar,
}


def returned(model: SmithLobe, own: Values, co: Tensor, tolerance: float) -> tuple[Tensor, float]:
    """What a compensated lobe returns for ks = 1 [1], and the share of it that may be wrong.

    F_back G(co), times 2 integral of G mu dmu / Gbar: Gbar is a quadrature in the lobe's own formula. For tolerances
    that it meets the quotient counts as 1.
    """
    whole = model.returned_albedo(own, co)
    if tolerance > 100 * MEAN_ERROR:
        return whole, MEAN_ERROR
    a = own["a"].double().unsqueeze(-1)
    rule = gauss(ORDER).to(co.device)
    edges = _edges(a.detach(), pieces(model.table_name).shape[1])
    low, step = edges[..., :-1, None], edges.diff()[..., None]
    mu = (low + step * rule.nodes).flatten(-2)
    mean = 2 * (model.lost(mu, a) * mu * (step * rule.weights).flatten(-2)).sum(-1)
    return whole * (mean / model.mean_lost(own["a"].double())), MEAN_PRECISE


def _edges(a: Tensor, cells: int) -> Tensor:
    """The cosines between which the spline of a width a (..., 1) is one polynomial of its coordinate, (..., cells + 1).

    They are found by halving, in logarithms and so to the relative rounding.
    """
    places = torch.arange(1, cells, dtype=a.dtype, device=a.device) / cells
    low, high = torch.full_like(places * a, -60.0), torch.zeros_like(places * a)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        below = across(torch.exp(middle), a) < places
        low, high = torch.where(below, middle, low), torch.where(below, high, middle)
    return torch.cat([torch.zeros_like(a), torch.exp(0.5 * (low + high)), torch.ones_like(a)], -1)
