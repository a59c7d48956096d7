"""The microfacet lobe with the GGX (Trowbridge-Reitz) distribution of normals.

    f(wi, wo) = ks F D G2 / (4 ci co),  D = 1 / (pi ax ay cos^4 theta_h (1 + p^2/ax^2 + q^2/ay^2)^2)   [1/sr]
    G1(w) = 2 / (1 + sqrt(1 + m)),  m = (ax^2 x^2 + ay^2 y^2) / z^2

ks, specular reflectance [1]; ax, ay, widths of the distribution of slopes along x and y [1], or one width a: the slope
at which D cos^4 theta_h falls to a quarter of its peak.
Options: G2 is `correlated` over height, 1 / (1/G1(wi) + 1/G1(wo) - 1), or `separable`, G1(wi) G1(wo), which is never
larger; F is `schlick` of f0, Fresnel reflectance at normal incidence [1], `constant` 1, or exact: `dielectric` of eta,
relative index of refraction [1], or `conductor` of eta and k, its extinction coefficient [1].
Reciprocal; the directional albedo is at most ks, and falls as the lobe gets rough: what the microfacets reflect more
than once is missing.
Source: Trowbridge and Reitz 1975; Walter, Marschner, Li and Torrance 2007, eqs. 33, 34; Heitz 2014, eqs. 85, 98, 99;
sampling of visible normals by spherical caps: Dupuy and Benyoub 2023. Departure: D is evaluated from the
unit half vector's components, so it stays exact to the horizon.
"""

import math

import torch
from torch import Tensor

from ..geometry import Geometry
from ..parameters import Parameter, Values
from ._smith import SmithLobe


class Ggx(SmithLobe):
    """A lobe with long tails."""

    name = "ggx"
    widths_along = ("a", "ax", "ay")
    normal_needs = frozenset({"ux", "uy", "uz"})

    @property
    def width_parameters(self) -> tuple[Parameter, ...]:
        """The declared width or widths [1], each in [1e-4, 10]."""
        along = {"a": "", "ax": " along x", "ay": " along y"}
        return tuple(
            Parameter(
                name,
                0.1,
                1e-4,
                10.0,
                f"width of the distribution of slopes{along[name]} [1]",
                search=(0.005, 1.5),
                scale="log",
            )
            for name in self.width_names
        )

    def normals(self, values: Values, g: Geometry) -> Tensor:
        """1 / (uz^2 + ux^2/ax^2 + uy^2/ay^2)^2 [1] for the unit half vector u, (..., 1)."""
        ax, ay = self.widths(values)
        return (g.uz.square() + (g.ux / ax).square() + (g.uy / ay).square()).reciprocal().square()

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
