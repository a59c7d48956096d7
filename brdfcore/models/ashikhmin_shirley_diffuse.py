"""Ashikhmin and Shirley's diffuse term, which dims towards grazing angles as the lobe brightens.

    f(wi, wo) = 28 kd / (23 pi) (1 - f0) (1 - (1 - ci/2)^5) (1 - (1 - co/2)^5)              [1/sr]

kd, diffuse reflectance [1] (the paper's Rd); f0, the lobe's Fresnel reflectance [1] (the paper's Rs), usually tied:
`ashikhmin_shirley_diffuse(f0=ashikhmin_shirley.f0)`.
Box: kd, f0 in [0, 1].
Reciprocal; the directional albedo is exactly kd (1 - f0) (1 - (1 - cos(theta)/2)^5).
Source: Ashikhmin and Shirley 2000, technical report eq. 16. Departure: 1 - (1 - x)^5 by its polynomial.
"""

import math

from torch import Tensor

from ..geometry import Geometry
from ._diffuse import CoupledDiffuse
from .fresnel import one_minus_fifth_power


class AshikhminShirleyDiffuse(CoupledDiffuse):
    """A reciprocal diffuse term for below a Fresnel lobe."""

    name = "ashikhmin_shirley_diffuse"
    good_for = "The body colour under a polished coat, such as varnish; dims towards grazing angles."
    basis_needs = ("ci", "co")

    def transmitted(self, g: Geometry) -> Tensor:
        """The term for kd (1 - f0) = 1 [1/sr], (..., 1)."""
        return 28 / (23 * math.pi) * one_minus_fifth_power(g.ci / 2) * one_minus_fifth_power(g.co / 2)
