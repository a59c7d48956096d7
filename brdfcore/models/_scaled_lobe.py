"""A lobe under one reflectance: f = ks * lobe, under the name that the model's `scale` gives it."""

from abc import abstractmethod
from typing import ClassVar

from torch import Tensor

from ..geometry import Geometry
from ..parameters import Parameter, Values
from .base import Model


class ScaledLobe(Model):
    """A lobe that a specular reflectance multiplies."""

    scale = "ks"
    lobe_needs: ClassVar[tuple[str, ...]] = ()
    typical_albedo = (1.0,)

    @property
    @abstractmethod
    def shape(self) -> tuple[Parameter, ...]:
        """The parameters of the lobe beside its reflectance."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Reflectance and shape."""
        reflectance = Parameter(self.scale, 0.1, 0.0, 1.0, "specular reflectance [1]", per_channel="yes")
        return (reflectance, *self.shape)

    @property
    def needs(self) -> frozenset[str]:
        """The quantities of the geometry that the lobe reads."""
        return frozenset(self.lobe_needs)

    @abstractmethod
    def lobe(self, values: Values, g: Geometry) -> Tensor:
        """The lobe for a reflectance of 1 [1/sr], (..., 1)."""

    def basis(self, values: Values, g: Geometry) -> tuple[Tensor, ...]:
        """The lobe alone."""
        return (self.lobe(values, g),)

    def coefficients(self, values: Values) -> tuple[Tensor, ...]:
        """The reflectance alone."""
        return (values[self.scale],)
