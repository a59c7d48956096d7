"""Cook and Torrance's microfacet lobe with Beckmann's distribution and V-shaped grooves.

    f(wi, wo) = ks F D G / (4 ci co)                                                        [1/sr]
    D = E / (pi a^2 cos^4 theta_h),  E = exp(-tan^2 theta_h / a^2)
    G = min(1, 2 hz co / (h.wo), 2 hz ci / (h.wo))

ks, specular reflectance [1]; a, root-mean-square slope times sqrt 2 [1] (the paper's m).
Options: F is `schlick` of f0, Fresnel reflectance at normal incidence [1], `constant` 1, or exact, as in the paper:
`dielectric` of eta, relative index of refraction [1], or `conductor` of eta and k, its extinction coefficient [1].
Box: ks, f0 in [0, 1]; a in [1e-4, 10]; eta in [1.0001, 4] (dielectric); eta in [0.01, 20] (conductor); k in [0, 20].
Reciprocal; the directional albedo is at most ks, since grooves reflect no more than meets them.
Source: Cook and Torrance 1982, "A reflectance model for computer graphics" (1981 at SIGGRAPH); sampled by the slopes,
Walter 2005 eqs. 6-9. Departure: 1/4 for the paper's 1/pi, so that ks F is what a facet reflects. G / (ci co) is
min(1/(ci co), 4 / (Hz (1 + e2) max(ci, co))), so nothing is lost at the horizon.
"""

import math

import torch
from torch import Tensor

from ..geometry import Geometry
from ..parameters import Values
from ._fresnel_lobe import FRESNEL, FresnelLobe
from ._gaussian_slopes import GaussianSlopes


class CookTorrance(FresnelLobe, GaussianSlopes):
    """An isotropic microfacet lobe whose shadowing has a kink."""

    name = "cook_torrance"
    good_for = "Metals and plastics that are equally rough in every direction; none that are brushed."
    option_groups = (FRESNEL,)
    lobe_needs = ("e2", "over_ci", "over_co", "over_hz")

    @property
    def needs(self) -> frozenset[str]:
        """The quantities of the geometry that the lobe reads."""
        return frozenset({*self.lobe_needs, *({"h_dot_wo"} if self.fresnel else ())})

    def lobe(self, values: Values, g: Geometry) -> Tensor:
        """The lobe for ks F = 1 [1/sr], (..., 1)."""
        root = torch.exp(-0.5 * self.exponent(values, g)) * (1 + g.e2)  # squared only here: (1 + e2)^2 could overflow
        d = root.square() / math.pi / values["a"] / values["a"]
        shadowed = 4 * g.over_hz / (1 + g.e2) * torch.minimum(g.over_ci, g.over_co)
        return 0.25 * d * torch.minimum(g.over_ci * g.over_co, shadowed)
