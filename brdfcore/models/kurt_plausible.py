"""Kurt, Szirmay-Kalos and Krivanek's lobe with the max(ci, co) shadowing term.

    f(wi, wo) = ks F D / (4 (h.wo) max(ci, co))                                             [1/sr]
    D = E / (pi mx my cos^4 theta_h),  E = exp(-(p^2/mx^2 + q^2/my^2))

ks, specular reflectance [1]; mx, my, root-mean-square slopes times sqrt 2 along x and y [1], or one width m.
Options: F is `schlick` of f0, Fresnel reflectance at normal incidence [1], as in the paper, `constant` 1, or exact:
`dielectric` of eta, relative index of refraction [1], or `conductor` of eta and k, its extinction coefficient [1].
Reciprocal. The paper calls it physically plausible; for rough lobes it is not (directional albedo 1.04 at m = 2).
Source: SIGGRAPH Computer Graphics 44(1), 2010, eq. 9; sampling eqs. 16-19. Departure: evaluated from slopes.
"""

import torch
from torch import Tensor

from ..geometry import Geometry
from ..parameters import Values
from ._kurt_family import KurtFamily


class KurtPlausible(KurtFamily):
    """The lobe without a shadowing exponent."""

    name = "kurt_plausible"

    def over_shadowing(self, values: Values, g: Geometry) -> Tensor:
        """1 / max(ci, co) [1], (..., 1)."""
        return torch.minimum(g.over_ci, g.over_co)
