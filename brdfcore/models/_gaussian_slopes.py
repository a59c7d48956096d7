"""Lobes whose half vector has Gaussian slopes: Ward's family, Kurt's, and microfacet lobes that are sampled so.

    E = exp(-(p^2/ax^2 + q^2/ay^2))                                           [1]
    p_h = E / (pi ax ay cos^3 theta_h)                                        [1/sr of the half vector]
    p = ax r cos 2 pi t,  q = ay r sin 2 pi t,  r = sqrt(-log1p(-s))

Source: Ward 1992; Walter 2005 eqs. 6-9; Kurt et al. 2010 eqs. 16-20. Departure: sampled and evaluated in slopes, so
that no quadrant is lost and s = 0 is no special case. Powers of 1/cos theta_h are multiplied onto exp(-Q/2), which
cannot overflow where E is 0.
"""

import math

import torch
from torch import Tensor

from ..geometry import Geometry
from ..parameters import Values
from ._half_vector import HalfVectorLobe, slope_width


class GaussianSlopes(HalfVectorLobe):
    """A half-vector lobe with a Gaussian distribution of slopes; widths are rms slopes times sqrt 2."""

    width = slope_width("root-mean-square slope times sqrt 2")

    @property
    def slope_needs(self) -> frozenset[str]:
        """The quantities that `exponent` reads."""
        return frozenset({"p", "q"} if self.anisotropic else {"e2"})

    @property
    def pdf_needs(self) -> frozenset[str]:
        """The quantities of the geometry that the density reads."""
        return self.slope_needs | {"e2", "over_h_dot_wo"}

    def exponent(self, values: Values, g: Geometry) -> Tensor:
        """Q = p^2/ax^2 + q^2/ay^2 [1], (..., 1), so that E = exp(-Q)."""
        wx, wy = self.widths(values)
        if self.anisotropic:
            return (g.p / wx).square() + (g.q / wy).square()
        return g.e2 / wx / wx  # not by the square: its gradient would overflow in float32

    def width_slopes(self, values: Values, g: Geometry) -> dict[str, Tensor]:
        """The derivatives of ln(E / (ax ay)) by the widths, by name, each (..., 1)."""
        if self.anisotropic:
            pairs = zip(self.width_names, self.widths(values), (g.p, g.q), strict=True)
            return {name: (2 * (slope / w).square() - 1) / w for name, w, slope in pairs}
        (name,), (w, _) = self.width_names, self.widths(values)
        return {name: (g.e2 / w / w - 1) * (2 / w)}

    def slopes(self, values: Values, u: Tensor) -> tuple[Tensor, Tensor]:
        """Gaussian slopes p, q (..., 1)."""
        wx, wy = self.widths(values)
        r = torch.sqrt(-torch.log1p(-u[..., :1]))
        t = 2 * math.pi * u[..., 1:]
        return wx * r * torch.cos(t), wy * r * torch.sin(t)

    def half_vector_density(self, values: Values, g: Geometry) -> Tensor:
        """E / (pi ax ay cos^3 theta_h) [1/sr], (..., 1)."""
        wx, wy = self.widths(values)
        root = torch.exp(-0.5 * self.exponent(values, g))
        return (root * (1 + g.e2)) * (root * torch.sqrt(1 + g.e2)) / (math.pi * wx * wy)
