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
from ..models._compensation import MEAN_ERROR, rise
from ..models._smith import SmithLobe
from ..models.fresnel import one_minus_fifth_power
from ..models.oren_nayar import _C1, _lost
from ..parameters import Values
from .rules import gauss

PANELS = 768  # of the quadrature of a spline's mean
MEAN_PRECISE = 1e-11  # of that mean, as a share of it

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
    if tolerance > MEAN_ERROR:
        return whole, MEAN_ERROR
    a = own["a"].double()
    rule = gauss(6).to(co.device)
    x = ((torch.arange(PANELS, device=co.device)[:, None] + rule.nodes) / PANELS).flatten()
    scale = rise(a).unsqueeze(-1)
    length = torch.log1p(1 / scale)
    mu = scale * torch.expm1(x * length)
    mean = (model.lost(mu, a.unsqueeze(-1)) * (rule.weights.repeat(PANELS) * length * mu * (mu + scale))).sum(-1)
    return whole * (2 / PANELS * mean / model.mean_lost(a)), MEAN_PRECISE
