"""The microfacet lobe with the GGX (Trowbridge-Reitz) distribution of normals.

    f(wi, wo) = ks F D G2 / (4 ci co),  D = 1 / (pi ax ay cos^4 theta_h (1 + p^2/ax^2 + q^2/ay^2)^2)   [1/sr]
    G1(w) = 2 / (1 + sqrt(1 + m)),  m = (ax^2 x^2 + ay^2 y^2) / z^2

ks, specular reflectance [1]; ax, ay, widths of the distribution of slopes along x and y [1], or one width a: the slope
at which D cos^4 theta_h falls to a quarter of its peak.
Options: `isotropic` has a, `anisotropic` ax and ay; G2 is `correlated` over height, 1 / (1/G1(wi) + 1/G1(wo) - 1), or
`separable`, G1(wi) G1(wo), which is never larger; F is `schlick` of f0, Fresnel reflectance at normal incidence [1],
`constant` 1, or exact: `dielectric` of eta, relative index of refraction [1], or `conductor` of eta and k, its
extinction coefficient [1]; `single` is the scattering by one facet that the equation is, `compensated`, which an
isotropic lobe can be, adds ks F_back G(ci) G(co) / (pi Gbar), what that loses (_compensation.py).
Box: ks, f0 in [0, 1]; a, ax, ay in [1e-4, 10]; eta in [1.0001, 4] (dielectric); eta in [0.01, 20] (conductor);
k in [0, 20].
Reciprocal; the directional albedo is at most ks, and falls as the lobe gets rough: what the microfacets reflect more
than once is missing. `compensated`, it is at most 1.00002 ks, and where F = 1 it is ks to 2e-5 at every angle and width
(tests/models/test_compensation.py).
Source: Trowbridge and Reitz 1975; Walter, Marschner, Li and Torrance 2007, eqs. 33, 34; Heitz 2014, eqs. 85, 98, 99;
sampling of visible normals by spherical caps: Dupuy and Benyoub 2023; compensation: Kulla and Conty 2017.
Departure: D is evaluated from the half vector's components without the largest of them, so that it and its derivatives
stay exact from h = n to wi = -wo; what is lost is read from a table.
"""

import math

import torch
from torch import Tensor

from ..geometry import Geometry
from ..parameters import Values
from ._half_vector import slope_width
from ._smith import SmithLobe


class Ggx(SmithLobe):
    """A lobe with long tails."""

    name = "ggx"
    good_for = "Rough metals and plastics whose highlight has a bright core and a wide glow."
    width = slope_width("width of the distribution of slopes")

    @property
    def normal_needs(self) -> frozenset[str]:
        """The quantities of the geometry that the distribution reads."""
        return frozenset({"ux", "uy", "uz"} if self.anisotropic else {"e2"})

    def normals(self, values: Values, g: Geometry) -> Tensor:
        """1 / S^2 [1], S = uz^2 + ux^2/ax^2 + uy^2/ay^2 for the unit half vector u, (..., 1).

        The largest component's square is eliminated by |u| = 1. The others' derivatives vanish with them, its own would
        cancel: where wi + wo is short, u turns by as much as 1 / |wi + wo|, and so would what is left of roundings.
        """
        ax, ay = self.widths(values)
        less_x, peak_x = (ax - 1) * (ax + 1) / ax / ax, ax.reciprocal().square()  # 1 - 1/ax^2 and 1/ax^2
        if not self.anisotropic:
            height2 = (1 + g.e2).reciprocal()
            s = torch.where(height2 > 0.5, 1 - less_x * (g.e2 * height2), peak_x + less_x * height2)
            return s.reciprocal().square()
        less_y, peak_y = (ay - 1) * (ay + 1) / ay / ay, ay.reciprocal().square()
        x2, y2, z2 = g.ux.square(), g.uy.square(), g.uz.square()
        turned = (ax - ay) * (ax + ay) * (peak_x * peak_y)  # 1/ay^2 - 1/ax^2
        level = torch.where(y2 < x2, peak_x + less_x * z2 + turned * y2, peak_y + less_y * z2 - turned * x2)
        return torch.where(z2 > 0.5, 1 - less_x * x2 - less_y * y2, level).reciprocal().square()

    def fading(self, mu: Tensor, a: Tensor) -> Tensor:
        """(a / (mu + a))^2 [1]: the tail of the distribution."""
        return (a / (mu + a)).square()

    def seen(self, z: Tensor, stretched2: Tensor) -> Tensor:
        """sqrt(z^2 + ax^2 x^2 + ay^2 y^2) / 2 [1]."""
        return 0.5 * torch.sqrt(z.square() + stretched2)

    def visible_slopes(self, values: Values, wo: Tensor, u: Tensor) -> tuple[Tensor, Tensor]:
        """Slopes p, q (..., 1).

        Stretched by the widths, wo is v; a point uniform on the cap of the unit sphere above -v.z, plus v, is the
        normal. Its height is (1 - s) (1 + v.z), of which nothing cancels, and is never 0.
        """
        ax, ay = self.widths(values)
        x, y, z = ax * wo[..., :1], ay * wo[..., 1:2], wo[..., 2:]
        norm = torch.sqrt(x.square() + y.square() + z.square())
        x, y, z = x / norm, y / norm, z / norm
        s, t = u[..., :1], 2 * math.pi * u[..., 1:]
        height = (1 - s) * (1 + z)
        below = (x.square() + y.square()) / (1 + z)  # 1 - z
        radius = torch.sqrt(s) * torch.sqrt((1 + z) * (below + height))
        return ax * (x + radius * torch.cos(t)) / height, ay * (y + radius * torch.sin(t)) / height
