"""Kurt, Szirmay-Kalos and Krivanek's lobe with the max(ci, co) shadowing term.

    f(wi, wo) = ks F D / (4 (h.wo) max(ci, co))                                             [1/sr]
    D = E / (pi mx my cos^4 theta_h),  E = exp(-(p^2/mx^2 + q^2/my^2))

ks, specular reflectance [1]; mx, my, root-mean-square slopes times sqrt 2 along x and y [1], or one width m.
Options: `isotropic` has m, `anisotropic` mx and my; F is `schlick` of f0, Fresnel reflectance at normal incidence [1],
as in the paper, `constant` 1, or exact: `dielectric` of eta, relative index of refraction [1], or `conductor` of eta
and k, its extinction coefficient [1].
Box: ks, f0 in [0, 1]; m, mx, my in [1e-4, 10]; eta in [1.0001, 4] (dielectric); eta in [0.01, 20] (conductor);
k in [0, 20].
Reciprocal. The paper calls it physically plausible; for rough lobes it is not: from m = 1.9 the directional albedo
exceeds ks towards grazing (1.04 ks at m = 2, 4.5 ks at m = 10).
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
    good_for = "Smooth to rough metals and paints; too bright at grazing angles if extremely rough."

    def over_shadowing(self, values: Values, g: Geometry) -> Tensor:
        """1 / max(ci, co) [1], (..., 1)."""
        return torch.minimum(g.over_ci, g.over_co)
