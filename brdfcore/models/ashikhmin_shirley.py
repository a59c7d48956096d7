"""Ashikhmin and Shirley's anisotropic Phong lobe.

    f(wi, wo) = ks sqrt((nu+1)(nv+1)) / (8 pi) hz^((nu hx^2 + nv hy^2)/(1 - hz^2)) F / ((h.wo) max(ci, co))   [1/sr]
    F = f0 + (1 - f0) (1 - h.wo)^5

f0, Fresnel reflectance at normal incidence [1] (the paper's Rs, so one a channel); nu, nv, exponents along x and y
[1], or one exponent n; ks, specular reflectance [1], 1 unless the option `scaled` or `constant` declares it.
Options: `schlick` is the paper's; `scaled` multiplies it by ks; `constant` replaces F by 1.
Reciprocal; conserves energy.
Source: Ashikhmin and Shirley 2000, technical report eqs. 10, 18; sampling eqs. 20-22 (the journal version lost the
square root and inverted the density). Departure: hz^(...) is exp(-(nu p^2 + nv q^2)/2 log1p(e2)/e2), exact at h = n and
for large exponents; the four quadrants of eq. 21 come from one angle of the full circle.
"""

import math

import torch
from torch import Tensor

from ..geometry import Geometry
from ..parameters import Parameter, Values
from ._fresnel_lobe import F0, FresnelLobe
from ._half_vector import ISOTROPY


def _times_log1p_ratio(x: Tensor, e2: Tensor) -> Tensor:
    """The product x log(1 + e2) / e2 for x of e2's order, the logarithm by its series below 1e-3 (next term 1e-21)."""
    small = e2 < 1e-3
    y = torch.where(small, e2, 0.0)
    series = 1 - y * (1 / 2 - y * (1 / 3 - y * (1 / 4 - y * (1 / 5 - y * (1 / 6 - y / 7)))))
    safe = torch.where(small, 1.0, e2)
    return torch.where(small, x * series, (x / safe) * torch.log1p(safe))  # 1/e2^2 would underflow in float32


class AshikhminShirley(FresnelLobe):
    """A power of the half vector's height, with an exponent that turns with the azimuth."""

    name = "ashikhmin_shirley"
    option_groups = (ISOTROPY, ("schlick", "scaled", "constant"))
    widths_along = ("n", "nu", "nv")
    lobe_needs = ("over_ci", "over_co", "e2", "over_h_dot_wo")

    @property
    def reflectances(self) -> tuple[Parameter, ...]:
        """The declared reflectances."""
        declared = []
        if "schlick" not in self.options:
            declared.append(Parameter("ks", 1.0, 0.0, 1.0, "specular reflectance [1]", per_channel="yes"))
        if self.fresnel:
            declared.append(Parameter("f0", F0.default, F0.low, F0.high, F0.description, per_channel="yes"))
        return tuple(declared)

    @property
    def width_parameters(self) -> tuple[Parameter, ...]:
        """The declared exponent or exponents [1], each in [1, 1e6]."""
        along = {"n": "", "nu": " along x", "nv": " along y"}
        return tuple(
            Parameter(name, 100.0, 1.0, 1e6, f"exponent{along[name]} [1]", search=(1.0, 2e4), scale="log")
            for name in self.width_names
        )

    @property
    def needs(self) -> frozenset[str]:
        """The quantities of the geometry that the lobe reads."""
        return frozenset(self.lobe_needs) | self.slope_needs | ({"h_dot_wo"} if self.fresnel else set())

    @property
    def slope_needs(self) -> frozenset[str]:
        """The quantities that `height` reads beside e2."""
        return frozenset({"p", "q"} if self.anisotropic else ())

    @property
    def pdf_needs(self) -> frozenset[str]:
        """The quantities of the geometry that the density reads."""
        return self.slope_needs | {"e2", "over_h_dot_wo"}

    def coefficients(self, values: Values) -> tuple[Tensor, ...]:
        """The products ks f0 and ks (1 - f0), with ks = 1 in the paper's own form, or ks alone."""
        if "schlick" in self.options:
            return (values["f0"], 1 - values["f0"])
        return super().coefficients(values)

    def height(self, values: Values, g: Geometry) -> Tensor:
        """sqrt((nu+1)(nv+1)) times hz to the exponent [1], (..., 1)."""
        nu, nv = self.widths(values)
        if self.anisotropic:
            norm = torch.sqrt((nu + 1) * (nv + 1))
            return norm * torch.exp(-0.5 * _times_log1p_ratio(nu * g.p.square() + nv * g.q.square(), g.e2))
        return (nu + 1) * torch.exp(-0.5 * nu * torch.log1p(g.e2))

    def lobe(self, values: Values, g: Geometry) -> Tensor:
        """The lobe for ks F = 1 [1/sr], (..., 1)."""
        return self.height(values, g) / (8 * math.pi) * g.over_h_dot_wo * torch.minimum(g.over_ci, g.over_co)

    def slopes(self, values: Values, u: Tensor) -> tuple[Tensor, Tensor]:
        """Slopes p, q (..., 1): the azimuth from the first number of u, the height from the second (eqs. 21, 22)."""
        nu, nv = self.widths(values)
        t = 2 * math.pi * u[..., :1]
        x, y = torch.sqrt(nv + 1) * torch.cos(t), torch.sqrt(nu + 1) * torch.sin(t)
        norm2 = x.square() + y.square()
        exponent = (nu * x.square() + nv * y.square()) / norm2
        tangent = torch.sqrt(torch.expm1(-2 * torch.log1p(-u[..., 1:]) / (exponent + 1)))
        norm = torch.sqrt(norm2)
        return tangent * x / norm, tangent * y / norm

    def half_vector_density(self, values: Values, g: Geometry) -> Tensor:
        """sqrt((nu+1)(nv+1)) / (2 pi) hz^(...) [1/sr], (..., 1)."""
        return self.height(values, g) / (2 * math.pi)
