"""Lambert's term under what a lobe's Fresnel factor lets through.

    f(wi, wo) = kd (1 - F) / pi = kd (1 - f0) (1 - (1 - h.wo)^5) / pi         [1/sr]

kd, diffuse reflectance [1]; f0, the lobe's Fresnel reflectance [1], usually tied: `coupled_lambert(f0=kurt.f0)`.
Box: kd, f0 in [0, 1].
Reciprocal; the directional albedo is below kd (1 - f0).
Source: Kurt, Szirmay-Kalos and Krivanek 2010, eq. 13. Departure: 1 - s by its polynomial, exact where h.wo goes to 0.
"""

import math

from torch import Tensor

from ..geometry import Geometry
from ._diffuse import CoupledDiffuse
from .fresnel import one_minus_fifth_power


class CoupledLambert(CoupledDiffuse):
    """A diffuse term that dims where the lobe takes the light."""

    name = "coupled_lambert"
    good_for = "The body colour of plastics and paints, dimmed where the gloss above takes the light."
    basis_needs = ("h_dot_wo",)

    def transmitted(self, g: Geometry) -> Tensor:
        """The term for kd (1 - f0) = 1 [1/sr], (..., 1)."""
        return one_minus_fifth_power(g.h_dot_wo) / math.pi
