"""Microfacet lobes with Smith's masking, sampled by the normals that are visible from wo.

    lobe = D G2 / (4 ci co),  correlated: G2 = 1 / (1 + L(wi) + L(wo)),  separable: G2 = G1(wi) G1(wo)   [1/sr]
    G1(w) = 1 / (1 + L(w)),  L a function of r = sqrt(ax^2 x^2 + ay^2 y^2) / z = a tan theta alone
    pdf(wi) = G1(wo) D / (4 co)                                                                         [1/sr]

D, the distribution of normals [1/sr], integrates to 1 against cos theta_h. The density integrates to 1 over the sphere;
what lies below the horizon would have been reflected again and is lost.
Source: Smith 1967; Walter, Marschner, Li and Torrance 2007; Heitz 2014, eqs. 43, 98, 99; visible normals: Heitz and
d'Eon 2014. Departure: written with B(w) = z (1/2 + L(w)), half of the area of the surface, front and back, that is seen
from w. Then ci co / G2 is co B(wi) + ci B(wo), or (B(wi) + ci/2) (B(wo) + co/2): sums of positive numbers that neither
vanish nor overflow at the horizon, where L is infinite.

`compensated` adds to the lobe what single scattering loses (_compensation.py), isotropic lobes only. Its samples are
the same visible normals and, with a share of G(co) beside their 1, directions of density
cos theta_i / (pi (cos^2 theta_i + a^2) log(1 + 1/a^2)) [1/sr], which falls as G does: no sample of either weighs more
than a few times ks.
"""

import math
from abc import abstractmethod

import torch
from torch import Tensor

from ..geometry import Geometry, reflect
from ..parameters import Values
from . import _compensation
from ._fresnel_lobe import FRESNEL, FresnelTerm
from ._half_vector import ISOTROPY
from .fresnel import MEAN_SCHLICK

LEAST_SHARE = 2.0**-64
ALMOST_1 = {dtype: 1 - torch.finfo(dtype).eps / 2 for dtype in (torch.float32, torch.float64)}


class SmithLobe(FresnelTerm):
    """A distribution of normals under Smith's masking and shadowing and, unless `constant`, a Fresnel factor."""

    option_groups = (ISOTROPY, ("correlated", "separable"), FRESNEL, ("single", "compensated"))
    apart = (("anisotropic", "compensated"),)

    @property
    @abstractmethod
    def normal_needs(self) -> frozenset[str]:
        """The quantities of the geometry that the distribution reads."""

    @property
    def needs(self) -> frozenset[str]:
        """The quantities of the geometry that the lobe reads."""
        needs = self.normal_needs | {"xi", "yi", "ci", "xo", "yo", "co"}
        return needs | ({"over_hz"} if self.correlated else set()) | ({"h_dot_wo"} if self.fresnel else set())

    @property
    def pdf_needs(self) -> frozenset[str]:
        """The quantities of the geometry that the density reads."""
        return self.normal_needs | {"xo", "yo", "co"} | ({"ci"} if self.compensated else set())

    @property
    def correlated(self) -> bool:
        """Whether masking and shadowing are one, since both grow with a facet's depth."""
        return "correlated" in self.options

    @property
    def compensated(self) -> bool:
        """Whether what single scattering loses is returned."""
        return "compensated" in self.options

    @property
    def single(self) -> "SmithLobe":
        """The same lobe without what is returned."""
        return type(self)([word for word in self.options if word != "compensated"])

    @property
    def table_name(self) -> str:
        """The name of the lobe's table of lost energy."""
        return f"{self.name}_{'correlated' if self.correlated else 'separable'}"

    @abstractmethod
    def fading(self, mu: Tensor, a: Tensor) -> Tensor:
        """About how the lost energy falls from the horizon, 1, to the normal [1]."""

    @abstractmethod
    def normals(self, values: Values, g: Geometry) -> Tensor:
        """The distribution times pi ax ay [1], (..., 1)."""

    @abstractmethod
    def seen(self, z: Tensor, stretched2: Tensor) -> Tensor:
        """B [1] of a direction of height z and ax^2 x^2 + ay^2 y^2 = stretched2; at least z/2."""

    @abstractmethod
    def visible_slopes(self, values: Values, wo: Tensor, u: Tensor) -> tuple[Tensor, Tensor]:
        """Slopes p, q (..., 1) of normals drawn from those visible from wo, for u (..., 2)."""

    def distribution(self, values: Values, g: Geometry) -> Tensor:
        """D [1/sr], (..., 1)."""
        wx, wy = self.widths(values)
        return self.normals(values, g) / (math.pi * wx * wy)

    def seen_from(self, values: Values, x: Tensor, y: Tensor, z: Tensor) -> Tensor:
        """B [1] of a direction, (..., 1)."""
        wx, wy = self.widths(values)
        return self.seen(z, (wx * x).square() + (wy * y).square())

    def lobe(self, values: Values, g: Geometry) -> Tensor:
        """The lobe for ks F = 1 [1/sr], (..., 1)."""
        d = self.distribution(values, g)
        bi, bo = self.seen_from(values, g.xi, g.yi, g.ci), self.seen_from(values, g.xo, g.yo, g.co)
        if self.correlated:
            return 0.25 * d * g.over_hz / (g.co * g.over_hz * bi + g.ci * g.over_hz * bo)
        return 0.25 * d / ((bi + 0.5 * g.ci) * (bo + 0.5 * g.co))

    def lost_factor(self, mu: Tensor, a: Tensor) -> Tensor:
        """What the table's spline is multiplied by [1]; separable masking loses energy at the horizon, too."""
        fading = self.fading(mu, a)
        return fading * (mu / (mu + _compensation.rise(a))) if self.correlated else fading

    def lost(self, mu: Tensor, a: Tensor) -> Tensor:
        """G [1] of a direction of cosine mu for the width a, which broadcast; double precision, to 1e-5."""
        mu, a = mu.double(), a.double()
        smooth = _compensation.spline(self.table_name, _compensation.across(mu, a), _compensation.along(a))
        return self.lost_factor(mu, a) * smooth

    def mean_lost(self, a: Tensor) -> Tensor:
        """Gbar [1] of the width a."""
        mu, weight = _compensation.cosines(a.double())
        return (self.lost(mu, a.unsqueeze(-1)) * weight).sum(-1)

    def returned_share(self, values: Values) -> Tensor:
        """F_back [1] for ks = 1, in double precision."""
        if not self.fresnel:
            return torch.ones_like(values["a"], dtype=torch.float64)
        if self.exact:
            mean_factor = _compensation.mean_fresnel(values)
        else:
            f0 = values["f0"].double()
            mean_factor = f0 + (1 - f0) * MEAN_SCHLICK
        return _compensation.returned_share(mean_factor, self.mean_lost(values["a"]))

    def returned(self, values: Values, g: Geometry) -> Tensor:
        """f_back [1/sr] for ks = 1, (..., 1), or (..., C) where the Fresnel factor has colour."""
        a = values["a"]
        mean = self.mean_lost(a)
        back = self.lost(g.ci, a) * self.lost(g.co, a) / (math.pi * mean)
        return (back * self.returned_share(values)).to(g.ci.dtype) if self.fresnel else back.to(g.ci.dtype)

    def returned_albedo(self, values: Values, co: Tensor) -> Tensor:
        """The directional albedo [1] of what is returned for ks = 1: F_back G(co)."""
        return self.returned_share(values) * self.lost(co, values["a"])

    def basis(self, values: Values, g: Geometry) -> tuple[Tensor, ...]:
        """The bases of single scattering; what is returned is added to the only one, or is one after Schlick's two."""
        single = super().basis(values, g)
        if not self.compensated:
            return single
        returned = self.returned(values, g)
        return (single[0] + returned,) if len(single) == 1 else (*single, returned)

    def coefficients(self, values: Values) -> tuple[Tensor, ...]:
        """The coefficients of single scattering and, where what is returned has its own basis, ks."""
        single = super().coefficients(values)
        return (*single, values["ks"]) if self.compensated and len(single) > 1 else single

    @property
    def typical_albedo(self) -> tuple[float, ...]:
        """That of single scattering as if it lost nothing, in which what is returned is counted."""
        single = super().typical_albedo
        return (*single, 0.0) if self.compensated and len(single) > 1 else single

    def sample(self, values: Values, wo: Tensor, u: Tensor) -> Tensor:
        """Directions wi (..., 3); one below the horizon is part of the density's lost share and weighs 0."""
        if not self.compensated:
            return reflect(wo, *self.visible_slopes(values, wo, u))
        a, most = values["a"], ALMOST_1[wo.dtype]
        lost = self.lost(wo[..., 2:], a).to(wo.dtype)
        first, second = u[..., :1] * (1 + lost), u[..., 1:]
        again = first >= 1
        visible = torch.cat(torch.broadcast_tensors(first.clamp(min=LEAST_SHARE, max=most), second), dim=-1)
        mirrored = reflect(wo, *self.visible_slopes(values, wo, visible))
        share = ((first - 1) / torch.where(again, lost, 1.0)).clamp(min=LEAST_SHARE, max=most)
        broad = _compensation.broad_direction(a, torch.where(again, share, 0.5), second)
        return torch.where(again, broad, mirrored)

    def pdf(self, values: Values, g: Geometry) -> Tensor:
        """G1(wo) D / (4 co) [1/sr], mixed with the density of what is returned."""
        visible = 0.25 * self.distribution(values, g) / (self.seen_from(values, g.xo, g.yo, g.co) + 0.5 * g.co)
        if not self.compensated:
            return visible
        a = values["a"]
        lost = self.lost(g.co, a).to(g.co.dtype)
        over = (g.ci.square() + a.square()) * torch.log1p(a.square().reciprocal())
        return (visible + lost * g.ci / (math.pi * over)) / (1 + lost)
