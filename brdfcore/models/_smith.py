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
"""

import math
from abc import abstractmethod

from torch import Tensor

from ..geometry import Geometry, reflect
from ..parameters import Values
from ._fresnel_lobe import FRESNEL, FresnelTerm
from ._half_vector import ISOTROPY


class SmithLobe(FresnelTerm):
    """A distribution of normals under Smith's masking and shadowing and, unless `constant`, a Fresnel factor."""

    option_groups = (ISOTROPY, ("correlated", "separable"), FRESNEL)

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
        return self.normal_needs | {"xo", "yo", "co"}

    @property
    def correlated(self) -> bool:
        """Whether masking and shadowing are one, since both grow with a facet's depth."""
        return "correlated" in self.options

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

    def sample(self, values: Values, wo: Tensor, u: Tensor) -> Tensor:
        """Directions wi (..., 3); one below the horizon is part of the density's lost share and weighs 0."""
        return reflect(wo, *self.visible_slopes(values, wo, u))

    def pdf(self, values: Values, g: Geometry) -> Tensor:
        """G1(wo) D / (4 co) [1/sr]."""
        return 0.25 * self.distribution(values, g) / (self.seen_from(values, g.xo, g.yo, g.co) + 0.5 * g.co)
