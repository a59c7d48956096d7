"""A lobe under one reflectance: f = rs * lobe. Ward's family."""

from abc import abstractmethod
from typing import ClassVar

from torch import Tensor

from ..geometry import Geometry
from ..parameters import Parameter, Values
from ._half_vector import HalfVectorLobe


class ScaledLobe(HalfVectorLobe):
    """A half-vector lobe that a specular reflectance multiplies."""

    scale = "rs"
    lobe_needs: ClassVar[tuple[str, ...]] = ()
    typical_albedo = (1.0,)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Reflectance and widths."""
        rs = Parameter("rs", 0.1, 0.0, 1.0, "specular reflectance [1]", per_channel="yes")
        return (rs, *self.width_parameters)

    @abstractmethod
    def lobe(self, values: Values, g: Geometry) -> Tensor:
        """The lobe for rs = 1 [1/sr], (..., 1)."""

    def basis(self, values: Values, g: Geometry) -> tuple[Tensor, ...]:
        """The lobe alone."""
        return (self.lobe(values, g),)

    def coefficients(self, values: Values) -> tuple[Tensor, ...]:
        """The reflectance alone."""
        return (values["rs"],)
