"""Ashikhmin and Shirley's anisotropic Phong lobe.

    f(wi, wo) = ks sqrt((nu+1)(nv+1)) / (8 pi) hz^((nu hx^2 + nv hy^2)/(1 - hz^2)) F / ((h.wo) max(ci, co))   [1/sr]
    F = f0 + (1 - f0) (1 - h.wo)^5

f0, Fresnel reflectance at normal incidence [1] (the paper's Rs, so one a channel); nu, nv, exponents along x and y
[1], or one exponent n; ks, specular reflectance [1], 1 unless the option `scaled` or `constant` declares it.
Options: `isotropic` has n, `anisotropic` nu and nv; `schlick` is the paper's lobe, `scaled` multiplies it by ks, and
`constant` has ks in the place of F.
Box: f0, ks in [0, 1]; n, nu, nv in [1, 1e6].
Reciprocal; the directional albedo is at most the largest F, and for a narrow lobe F.
Source: Ashikhmin and Shirley 2000, technical report eqs. 10, 18; sampling eqs. 20-22 (the journal version lost the
square root and inverted the density). Departure: hz^(...) is exp(-(nu p^2 + nv q^2)/2 log1p(e2)/e2), exact at h = n and
for large exponents; the four quadrants of eq. 21 come from one angle of the full circle.
"""

from dataclasses import replace

import torch
from torch import Tensor

from ..geometry import Geometry
from ..parameters import Parameter, Values
from ._fresnel_lobe import F0, KS, FresnelLobe
from ._half_vector import ISOTROPY
from ._height_power import HeightPower


class AshikhminShirley(FresnelLobe, HeightPower):
    """A power of the half vector's height, with an exponent that turns with the azimuth."""

    name = "ashikhmin_shirley"
    good_for = "Polished or brushed surfaces whose highlight brightens towards grazing angles."
    option_groups = (ISOTROPY, ("schlick", "scaled", "constant"))
    lobe_needs = ("over_ci", "over_co", "over_h_dot_wo")

    @property
    def reflectances(self) -> tuple[Parameter, ...]:
        """The declared reflectances."""
        declared = []
        if "schlick" not in self.options:
            declared.append(replace(KS, default=1.0))
        if self.fresnel:
            declared.append(replace(F0, per_channel="yes"))
        return tuple(declared)

    @property
    def needs(self) -> frozenset[str]:
        """The quantities of the geometry that the lobe reads."""
        return self.power_needs | set(self.lobe_needs) | ({"h_dot_wo"} if self.fresnel else set())

    def coefficients(self, values: Values) -> tuple[Tensor, ...]:
        """The products ks f0 and ks (1 - f0), with ks = 1 in the paper's own form, or ks alone."""
        if "schlick" in self.options:
            return (values["f0"], 1 - values["f0"])
        return super().coefficients(values)

    def lobe(self, values: Values, g: Geometry) -> Tensor:
        """The lobe for ks F = 1 [1/sr], (..., 1)."""
        return 0.25 * self.half_vector_density(values, g) * g.over_h_dot_wo * torch.minimum(g.over_ci, g.over_co)
