"""The microfacet lobe with Beckmann's distribution of normals, a surface of Gaussian slopes.

    f(wi, wo) = ks F D G2 / (4 ci co),  D = exp(-(p^2/ax^2 + q^2/ay^2)) / (pi ax ay cos^4 theta_h)     [1/sr]
    G1(w) = 2 / (1 + erf(1/r) + r exp(-1/r^2) / sqrt(pi)),  r^2 = (ax^2 x^2 + ay^2 y^2) / z^2

ks, specular reflectance [1]; ax, ay, root-mean-square slopes times sqrt 2 along x and y [1], or one width a.
Options: `isotropic` has a, `anisotropic` ax and ay; G2 is `correlated` over height, 1 / (1/G1(wi) + 1/G1(wo) - 1), or
`separable`, G1(wi) G1(wo), which is never larger; F is `schlick` of f0, Fresnel reflectance at normal incidence [1],
`constant` 1, or exact: `dielectric` of eta, relative index of refraction [1], or `conductor` of eta and k, its
extinction coefficient [1]; `single` is the scattering by one facet that the equation is, `compensated`, which an
isotropic lobe can be, adds ks F_back G(ci) G(co) / (pi Gbar), what that loses (_compensation.py).
Box: ks, f0 in [0, 1]; a, ax, ay in [1e-4, 10]; eta in [1.0001, 4] (dielectric); eta in [0.01, 20] (conductor);
k in [0, 20].
Reciprocal; the directional albedo is at most ks, and falls as the lobe gets rough: what the microfacets reflect more
than once is missing. `compensated`, it is at most 1.00004 ks, and where F = 1 it is ks to 4e-5 at every angle and width
(tests/models/test_compensation.py).
Source: Beckmann and Spizzichino 1963; Smith 1967; Walter, Marschner, Li and Torrance 2007, eqs. 25, 26; Heitz 2014,
eqs. 83, 98, 99; sampling of visible normals: Heitz and d'Eon 2014, and the inversion's start by Jakob 2014;
compensation: Kulla and Conty 2017.
Departure: Smith's own G1 where others take Walter's rational fit of it; the inversion is solved to 1e-12 of the
cumulative distribution by a fixed number of steps; what is lost is read from a table.
"""

import math

import torch
from torch import Tensor

from ..geometry import FLOOR, Geometry
from ..parameters import Values
from ._gaussian_slopes import GaussianSlopes
from ._smith import SmithLobe

SMALLEST = 1 / 800  # of r^2: exp(-800) is 0 in float64, and so are L and its derivatives
LEVEL = 2.0**-100  # r^2 below which every azimuth is wo's
HALLEY_STEPS = 3  # from Jakob's start they leave 1e-11 of the cumulative distribution, and one of Newton's follows


class Beckmann(SmithLobe, GaussianSlopes):
    """A lobe with Gaussian tails."""

    name = "beckmann"
    good_for = "Rough metals and plastics whose highlight falls off quickly, without a wide glow."

    @property
    def normal_needs(self) -> frozenset[str]:
        """The quantities of the geometry that the distribution reads."""
        return self.slope_needs | {"e2"}

    def normals(self, values: Values, g: Geometry) -> Tensor:
        """E (1 + e2)^2 [1], (..., 1)."""
        root = torch.exp(-0.5 * self.exponent(values, g)) * (1 + g.e2)  # squared only here: (1 + e2)^2 could overflow
        return root.square()

    def fading(self, mu: Tensor, a: Tensor) -> Tensor:
        """exp(-m / a^2) [1], m about the least sum of squared slopes, h's and wi's cotangent, that lose light."""
        mu2 = mu * mu
        mu4 = mu2 * mu2
        return torch.exp(-(mu2 * (0.2 + 0.1 * mu2) + 0.19 * mu4 * mu4 * mu4) / (a * a))

    def seen(self, z: Tensor, stretched2: Tensor) -> Tensor:
        """(z erf(z/s) + s exp(-z^2/s^2) / sqrt(pi)) / 2 [1] for s^2 = ax^2 x^2 + ay^2 y^2."""
        s = torch.sqrt(torch.maximum(stretched2, SMALLEST * z.square()))
        v = z / s
        return 0.5 * (z * torch.erf(v) + s * torch.exp(-v.square()) / math.sqrt(math.pi))

    def visible_slopes(self, values: Values, wo: Tensor, u: Tensor) -> tuple[Tensor, Tensor]:
        """Slopes p, q (..., 1): drawn for unit widths with wo stretched into the plane y = 0, turned and scaled."""
        ax, ay = (width.double() for width in self.widths(values))
        x, y, z = ax * wo[..., :1], ay * wo[..., 1:2], wo[..., 2:].double().clamp(min=FLOOR[torch.float64])
        tangent2 = (x.square() + y.square()) / z / z
        level = tangent2 < LEVEL
        tangent = torch.sqrt(torch.where(level, LEVEL, tangent2))
        cosine, sine = (torch.where(level, start, w / z / tangent) for w, start in ((x, 1.0), (y, 0.0)))
        along = _visible_slope(tangent, u[..., :1].double())
        across = torch.special.ndtri(u[..., 1:].double().clamp(min=2.0**-64)) / math.sqrt(2)
        p, q = ax * (cosine * along - sine * across), ay * (sine * along + cosine * across)
        return p.to(wo.dtype), q.to(wo.dtype)


def _masking(r: Tensor) -> Tensor:
    """L [1] of r > 0."""
    return r * torch.exp(-1 / r / r) / (2 * math.sqrt(math.pi)) - 0.5 * torch.erfc(1 / r)


def _visible_slope(r: Tensor, u: Tensor) -> Tensor:
    """The slope [1] along a direction of tangent r, of normals visible from it on a surface of unit widths.

    Its density is (1 + r p) exp(-p^2) / (sqrt(pi) (1 + L)) for p > -1/r, and what lies above p is
    (erfc(p) / 2 + r exp(-p^2) / (2 sqrt(pi))) / (1 + L). The half of the distribution that u lies in is the one solved,
    so that no tail is lost. It is solved without history; a last step of Newton's has the derivatives by r and u.
    """
    above = u >= 0.5
    side = torch.where(above, -1.0, 1.0).to(u)

    def excess(p: Tensor, r: Tensor, u: Tensor) -> Tensor:
        hidden = _masking(r)
        found = 0.5 * torch.erfc(-side * p) - side * r * torch.exp(-p.square()) / (2 * math.sqrt(math.pi))
        wanted = torch.where(above, 1 - u, u) * (1 + hidden) - torch.where(above, 0.0, hidden)
        return side * (found - wanted)

    def slope(p: Tensor, r: Tensor) -> tuple[Tensor, Tensor]:
        facing = torch.maximum(1 + r * p, 1e-7 * (1 + r))  # 0 at the least slope, where u = 0
        return facing, facing * torch.exp(-p.square()) / math.sqrt(math.pi)

    r_, u_ = r.detach(), u.detach()
    angle = torch.atan(r_)
    power = 1 + angle * (-0.876 + angle * (0.4265 - 0.0594 * angle))
    share = -torch.expm1(power * torch.log(u_.clamp(min=2.0**-64))) * (1 - 0.5 * torch.erfc(1 / r_))
    least = (-1 / r_).clamp(min=-7.0)  # erfc(7) is below what u can tell from 0
    most = torch.sqrt(-torch.log1p(-u_))  # the slope at grazing wo; elsewhere it is smaller
    p = torch.minimum(torch.maximum(-torch.special.ndtri(share) / math.sqrt(2), least), most)
    for _ in range(HALLEY_STEPS):
        facing, density = slope(p, r_)
        step = excess(p, r_, u_) / density
        p = p - step / (1 - 0.5 * step * (r_ / facing - 2 * p)).clamp(min=0.5)
        p = torch.minimum(torch.maximum(p, least), most)
    return p - excess(p, r, u) / slope(p, r_)[1]
