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
    lobe_needs = ("over_ci", "over_co")

    @property
    def needs(self) -> frozenset[str]:
        """The quantities of the geometry that the lobe reads."""
        return self.slope_needs | {"e2", "over_h_dot_wo", *self.lobe_needs, *({"h_dot_wo"} if self.fresnel else ())}

    @abstractmethod
    def over_shadowing(self, values: Values, g: Geometry) -> Tensor:
        """What multiplies D / (4 h.wo) [1], (..., 1)."""

    def lobe(self, values: Values, g: Geometry) -> Tensor:
        """The lobe for ks F = 1 [1/sr], (..., 1)."""
        mx, my = self.widths(values)
        root = torch.exp(-0.5 * self.exponent(values, g)) * (1 + g.e2)  # squared only here: (1 + e2)^2 could overflow
        lobe = root.square() / (4 * math.pi * mx * my) * g.over_h_dot_wo
        over = self.over_shadowing(values, g)
        if lobe.dtype == torch.float64:
            return lobe * over  # at most 1e160: the geometry's floor is 7e-49
        # The product alone can overflow, in float32 at grazing angles. Near that it has no gradient, since sums of
        # overflowing derivatives would be NaN, and it stops at the largest number.
        largest = torch.finfo(lobe.dtype).max
        limit = 2.0**-20 * largest / lobe.detach()
        beyond = (lobe.detach() * over.detach()).clamp(max=largest)
        return torch.where(over < limit, lobe * torch.minimum(over, limit), beyond)

    def log_slopes(self, values: Values, g: Geometry) -> dict[str, Tensor]:
        """Those by the widths, which nothing but D reads."""
        return self.width_slopes(values, g)
