"""Ashikhmin and Premoze's distribution-based lobe, with Gaussian slopes.

    f(wi, wo) = ks F P / (4 (ci + co - ci co))                                              [1/sr]
    P = E / (pi ax ay cos^3 theta_h),  E = exp(-(p^2/ax^2 + q^2/ay^2))

ks, specular reflectance [1]; ax, ay, root-mean-square slopes times sqrt 2 along x and y [1], or one width a.
Options: `isotropic` has a, `anisotropic` ax and ay; F is `schlick` of f0, Fresnel reflectance at normal incidence [1],
`constant` 1, or exact: `dielectric` of eta, relative index of refraction [1], or `conductor` of eta and k, its
extinction coefficient [1].
Box: ks, f0 in [0, 1]; a, ax, ay in [1e-4, 10]; eta in [1.0001, 4] (dielectric); eta in [0.01, 20] (conductor);
k in [0, 20].
P integrates to 1 over the half vectors' solid angle, so it is the density that the lobe is sampled by, and
P / cos theta_h is the height field's D.
Reciprocal; the directional albedo is at most ks, and for a narrow lobe ks F cos theta / (2 - cos theta).
Source: Ashikhmin and Premoze 2007, "Distribution-based BRDFs"; sampled by the slopes, Walter 2005 eqs. 6-9.
Departure: P is a Gaussian of slopes, where the paper leaves it open; ks / 4 is in the place of the paper's constant.
"""

from torch import Tensor

from ..geometry import Geometry
from ..parameters import Values
from ._fresnel_lobe import FresnelLobe
from ._gaussian_slopes import GaussianSlopes


class AshikhminPremoze(FresnelLobe, GaussianSlopes):
    """A lobe that any density of half vectors makes."""

    name = "ashikhmin_premoze"
    good_for = "Soft plain or brushed gloss that grows darker towards grazing angles."
    lobe_needs = ("e2", "ci", "co", "over_hz")

    @property
    def needs(self) -> frozenset[str]:
        """The quantities of the geometry that the lobe reads."""
        return self.slope_needs | {*self.lobe_needs, *({"h_dot_wo"} if self.fresnel else ())}

    def lobe(self, values: Values, g: Geometry) -> Tensor:
        """The lobe for ks F = 1 [1/sr], (..., 1)."""
        over_sum = g.over_hz / (1 - g.ci * g.co * g.over_hz)  # ci co / (ci + co) is at most 1/2
        return 0.25 * self.half_vector_density(values, g) * over_sum
