"""Kurt, Szirmay-Kalos and Krivanek's anisotropic lobe for data fitting.

    f(wi, wo) = ks F D / (4 (h.wo) (ci co)^alpha)                                           [1/sr]
    D = E / (pi mx my cos^4 theta_h),  E = exp(-(p^2/mx^2 + q^2/my^2))

ks, specular reflectance [1]; mx, my, root-mean-square slopes times sqrt 2 along x and y [1], or one width m; alpha,
shadowing exponent [1].
Options: `isotropic` has m, `anisotropic` mx and my; F is `schlick` of f0, Fresnel reflectance at normal incidence [1],
as in the paper, `constant` 1, or exact: `dielectric` of eta, relative index of refraction [1], or `conductor` of eta
and k, its extinction coefficient [1].
Box: ks, f0, alpha in [0, 1]; m, mx, my in [1e-4, 10]; eta in [1.0001, 4] (dielectric); eta in [0.01, 20] (conductor);
k in [0, 20].
Reciprocal. The directional albedo is at most ks for alpha = 0; for every alpha > 0 it diverges towards grazing,
although the paper calls suitable alpha plausible (at m = 0.5 it exceeds ks from 89.6 degrees for alpha = 0.25, from
79.8 for 0.5).
Source: SIGGRAPH Computer Graphics 44(1), 2010, eqs. 4, 5, 10, 12; sampling eqs. 16-19, density eq. 20, weight eq. 21.
Departure: evaluated from the half vector's slopes p, q, so nothing is lost near the normal or at the horizon.
"""

import torch
from torch import Tensor

from ..geometry import Geometry
from ..parameters import Parameter, Values
from ._kurt_family import KurtFamily


class Kurt(KurtFamily):
    """A Gaussian-slope lobe whose shadowing exponent is fitted to the material."""

    name = "kurt"
    good_for = "Close fits to measured metals, paints and cloth; may reflect too much at grazing angles."
    shape = (Parameter("alpha", 0.1, 0.0, 1.0, "shadowing exponent [1]", search=(0.0, 0.5)),)

    def over_shadowing(self, values: Values, g: Geometry) -> Tensor:
        """(ci co)^-alpha [1], (..., 1)."""
        return (g.over_ci * g.over_co) ** values["alpha"]

    def log_slopes(self, values: Values, g: Geometry) -> dict[str, Tensor]:
        """Those by the widths, and by alpha."""
        return {**super().log_slopes(values, g), "alpha": torch.log(g.over_ci * g.over_co)}
