"""Lobes that are a power of the half vector's height: Blinn's, and Ashikhmin and Shirley's anisotropic one.

    P = hz^((nu hx^2 + nv hy^2)/(1 - hz^2)) = exp(-(nu p^2 + nv q^2)/2 log1p(e2)/e2)          [1]
    p_h = sqrt((nu+1)(nv+1)) / (2 pi) P                                                      [1/sr of the half vector]

Source: Ashikhmin and Shirley 2000, technical report eqs. 10, 20-22. Departure: the exponential form, exact at h = n and
for large exponents; the four quadrants of eq. 21 come from one angle of the full circle.
"""

import math

import torch
from torch import Tensor

from ..geometry import Geometry
from ..parameters import Parameter, Values
from ._half_vector import HalfVectorLobe


def _times_log1p_ratio(x: Tensor, e2: Tensor) -> Tensor:
    """The product x log(1 + e2) / e2 for x of e2's order, the logarithm by its series below 1e-3 (next term 1e-21)."""
    small = e2 < 1e-3
    y = torch.where(small, e2, 0.0)
    series = 1 - y * (1 / 2 - y * (1 / 3 - y * (1 / 4 - y * (1 / 5 - y * (1 / 6 - y / 7)))))
    safe = torch.where(small, 1.0, e2)
    return torch.where(small, x * series, (x / safe) * torch.log1p(safe))  # 1/e2^2 would underflow in float32


class HeightPower(HalfVectorLobe):
    """A power of the half vector's height, whose exponent turns with the azimuth where the lobe is anisotropic."""

    widths_along = ("n", "nu", "nv")
    width = Parameter("n", 100.0, 1.0, 1e6, "exponent", search=(1.0, 2e4), scale="log")

    @property
    def power_needs(self) -> frozenset[str]:
        """The quantities that `power` reads."""
        return frozenset({"p", "q", "e2"} if self.anisotropic else {"e2"})

    @property
    def pdf_needs(self) -> frozenset[str]:
        """The quantities of the geometry that the density reads."""
        return self.power_needs | {"over_h_dot_wo"}

    def power(self, values: Values, g: Geometry) -> Tensor:
        """The height hz to the exponent [1], (..., 1)."""
        nu, nv = self.widths(values)
        if self.anisotropic:
            return torch.exp(-0.5 * _times_log1p_ratio(nu * g.p.square() + nv * g.q.square(), g.e2))
        return torch.exp(-0.5 * nu * torch.log1p(g.e2))

    def slopes(self, values: Values, u: Tensor) -> tuple[Tensor, Tensor]:
        """Slopes p, q (..., 1): the azimuth from the first number of u, the height from the second (eqs. 21, 22)."""
        nu, nv = self.widths(values)
        t = 2 * math.pi * u[..., :1]
        x, y = torch.sqrt(nv + 1) * torch.cos(t), torch.sqrt(nu + 1) * torch.sin(t)
        norm2 = x.square() + y.square()
        exponent = (nu * x.square() + nv * y.square()) / norm2
        tangent2 = torch.expm1(-2 * torch.log1p(-u[..., 1:]) / (exponent + 1))
        tangent = torch.sqrt(tangent2.clamp(min=torch.finfo(u.dtype).tiny))  # the root of 0 has no derivative
        norm = torch.sqrt(norm2)
        return tangent * x / norm, tangent * y / norm

    def half_vector_density(self, values: Values, g: Geometry) -> Tensor:
        """The density p_h [1/sr], (..., 1)."""
        nu, nv = self.widths(values)
        norm = torch.sqrt((nu + 1) * (nv + 1)) if self.anisotropic else nu + 1
        return norm / (2 * math.pi) * self.power(values, g)
