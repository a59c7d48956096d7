"""Whether a material looks the same however it is turned about its normal."""

import math

import torch

from ..models.material import Material
from ._difference import nodes

_TURNS = (0.5, 1.9, 3.0)  # [rad]; no two of them are multiples of one symmetry
_SAME = 1e-9  # relative to the largest value: rounding of the turned directions, times the steepness of narrow lobes


def is_isotropic(material: Material) -> bool:
    """Whether turning both directions about the normal changes nothing."""
    at = nodes(material, 256)
    largest = at.f.abs().max().clamp(min=1e-300)
    with torch.no_grad():
        for angle in _TURNS:
            c, s = math.cos(angle), math.sin(angle)
            turn = torch.tensor([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64)
            if bool(((material.f(at.wi @ turn, at.wo @ turn) - at.f).abs() > _SAME * largest).any()):
                return False
    return True
