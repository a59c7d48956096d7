"""Kurt's two lobes: ks F D / (4 h.wo), D = E / (pi mx my cos^4 theta_h), over a shadowing term of their own."""

import math
from abc import abstractmethod

import torch
from torch import Tensor

from ..geometry import Geometry
from ..parameters import Values
from ._fresnel_lobe import FresnelLobe
from ._gaussian_slopes import GaussianSlopes


class KurtFamily(FresnelLobe, GaussianSlopes):
    """A Gaussian-slope microfacet lobe under a Fresnel factor."""

    widths_along = ("m", "mx", "my")
    lobe_needs = ("ci", "co")

    @property
    def needs(self) -> frozenset[str]:
        """The quantities of the geometry that the lobe reads."""
        return self.slope_needs | {"e2", "h_dot_wo", *self.lobe_needs}

    @abstractmethod
    def shadowing(self, values: Values, g: Geometry) -> Tensor:
        """What divides the lobe beside 4 h.wo [1], (..., 1)."""

    def lobe(self, values: Values, g: Geometry) -> Tensor:
        """The lobe for ks F = 1 [1/sr], (..., 1)."""
        mx, my = self.widths(values)
        root = torch.exp(-0.5 * self.exponent(values, g)) * (1 + g.e2)  # squared only here: (1 + e2)^2 could overflow
        return root.square() / (math.pi * mx * my) / (4 * g.h_dot_wo) / self.shadowing(values, g)
