"""Directional albedos that have an exact form, basis by basis [1].

lambert: 1. ashikhmin_shirley_diffuse: 1 - (1 - co/2)^5 (techreport eqs. 12, 15). oren_nayar, qualitative:
A + B/pi (s (theta - s c) + 2/3 tan theta (1 - s^3)) with s = sin theta_o, c = cos theta_o; energy-preserving: E for the
first reflection and 1 - E for the others (Portsmouth, Kutz and Hill 2025, with Oren and Nayar's A and B 1994).
"""

import math
from collections.abc import Callable

import torch
from torch import Tensor

from ..models import Model
from ..models.fresnel import one_minus_fifth_power
from ..models.oren_nayar import _C1, _lost
from ..parameters import Values

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
