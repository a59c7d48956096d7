"""Ward's anisotropic lobe.

    f(wi, wo) = rs E / (4 pi ax ay sqrt(ci co)),   E = exp(-(p^2/ax^2 + q^2/ay^2))          [1/sr]

rs, specular reflectance [1]; ax, ay, root-mean-square slopes times sqrt 2 along x and y [1], or one width a.
Options: `isotropic` has a, `anisotropic` ax and ay.
Box: rs in [0, 1]; a, ax, ay in [1e-4, 10].
Reciprocal. The directional albedo is below rs at steep angles and diverges towards grazing: isotropic, it exceeds rs
from 89.993 degrees at a = 0.1, and at no width before 89.73 (a = 0.7).
Source: Ward 1992; Walter 2005 eqs. 3, 4; sampling eqs. 6, 7, 9. Departure: the published form with the exact exponent,
not Ward's computational approximation of it.
"""

import torch
from torch import Tensor

from ..geometry import Geometry
from ._ward_family import WardFamily


class Ward(WardFamily):
    """Ward's original normalisation."""

    name = "ward"
    good_for = "Brushed metal and plain gloss, to match published values; too bright close to grazing."
    lobe_needs = ("over_ci", "over_co")

    def factor(self, g: Geometry, exponent: Tensor) -> Tensor:
        """E / (4 sqrt(ci co)) [1], (..., 1)."""
        return 0.25 * torch.exp(-exponent) * (torch.sqrt(g.over_ci) * torch.sqrt(g.over_co))
