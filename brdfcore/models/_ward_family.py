"""What Ward's lobe and its successors share: rs E / (pi ax ay) times a shadowing-like factor of their own."""

import math
from abc import abstractmethod

from torch import Tensor

from ..geometry import Geometry
from ..parameters import Parameter, Values
from ._gaussian_slopes import GaussianSlopes
from ._scaled_lobe import ScaledLobe


class WardFamily(ScaledLobe, GaussianSlopes):
    """A Gaussian-slope lobe under a specular reflectance."""

    scale = "rs"

    @property
    def shape(self) -> tuple[Parameter, ...]:
        """The widths."""
        return self.width_parameters

    @property
    def needs(self) -> frozenset[str]:
        """The quantities of the geometry that the lobe reads."""
        return self.slope_needs | set(self.lobe_needs)

    @abstractmethod
    def factor(self, g: Geometry, exponent: Tensor) -> Tensor:
        """E = exp(-exponent) times what tells the family's members apart [1], (..., 1)."""

    def lobe(self, values: Values, g: Geometry) -> Tensor:
        """The lobe for rs = 1 [1/sr], (..., 1)."""
        wx, wy = self.widths(values)
        return self.factor(g, self.exponent(values, g)) / (math.pi * wx * wy)

    def log_slopes(self, values: Values, g: Geometry) -> dict[str, Tensor]:
        """Those by the widths, which nothing but E / (ax ay) reads."""
        return self.width_slopes(values, g)
