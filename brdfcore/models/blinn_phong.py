"""Blinn's power of the half vector's height, normalised.

    f(wi, wo) = ks (n+2) / (8 pi) hz^n                                                      [1/sr]

ks, specular reflectance [1]; n, exponent [1].
Box: ks in [0, 1]; n in [1, 1e6].
Reciprocal; the directional albedo is below ks, and for a narrow lobe ks cos^2 theta.
Source: Blinn 1977, "Models of light reflection for computer synthesized pictures"; sampled by the density
(n+1)/(2 pi) hz^n of the half vector, Ashikhmin and Shirley 2000, technical report eqs. 20-22. Departure: the factor
(n+2)/(8 pi) is the usual normalisation, not Blinn's; hz^n is exp(-n/2 log1p(e2)).
"""

import math

from torch import Tensor

from ..geometry import Geometry
from ..parameters import Parameter, Values
from ._height_power import HeightPower
from ._scaled_lobe import ScaledLobe


class BlinnPhong(ScaledLobe, HeightPower):
    """An isotropic power lobe without Fresnel or shadowing."""

    name = "blinn_phong"
    good_for = "Simple round highlights, as older renderers draw them; they fade towards grazing angles."
    option_groups = ()
    lobe_needs = ("e2",)

    @property
    def shape(self) -> tuple[Parameter, ...]:
        """The exponent."""
        return self.width_parameters

    def lobe(self, values: Values, g: Geometry) -> Tensor:
        """The lobe for ks = 1 [1/sr], (..., 1)."""
        return (values["n"] + 2) / (8 * math.pi) * self.power(values, g)
