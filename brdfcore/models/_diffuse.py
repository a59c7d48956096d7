"""Diffuse terms: sampled by the cosine, and coupled to a lobe by the factor 1 - f0.

sample: wi = (r cos 2 pi t, r sin 2 pi t, sqrt(1 - s)),  r = sqrt(s);   pdf = cos theta_i / pi        [1/sr]
"""

import math
from abc import abstractmethod
from typing import ClassVar

import torch
from torch import Tensor

from ..geometry import Geometry
from ..parameters import Parameter, Values
from .base import Model

KD = Parameter("kd", 0.2, 0.0, 1.0, "diffuse reflectance [1]", per_channel="yes")


class CosineSampled(Model):
    """A term with cosine-distributed samples."""

    pdf_needs = frozenset({"ci"})

    def sample(self, values: Values, wo: Tensor, u: Tensor) -> Tensor:
        """Cosine-distributed directions wi (..., 3)."""
        s, t = u[..., :1], 2 * math.pi * u[..., 1:]
        r = torch.sqrt(s)
        return torch.cat([r * torch.cos(t), r * torch.sin(t), torch.sqrt(1 - s)], dim=-1)

    def pdf(self, values: Values, g: Geometry) -> Tensor:
        """The density cos theta_i / pi [1/sr], (..., 1)."""
        return g.ci / math.pi


class Diffuse(CosineSampled):
    """A term that a diffuse reflectance multiplies."""

    scale = "kd"
    parameters: tuple[Parameter, ...] = (KD,)
    basis_needs: ClassVar[tuple[str, ...]] = ()
    typical_albedo = (1.0,)

    @property
    def needs(self) -> frozenset[str]:
        """The quantities of the geometry that the basis reads."""
        return frozenset(self.basis_needs)

    def coefficients(self, values: Values) -> tuple[Tensor, ...]:
        """The reflectance alone."""
        return (values["kd"],)


class CoupledDiffuse(Diffuse):
    """A diffuse term that gets the light that a lobe's Fresnel factor lets through: coefficient kd (1 - f0).

    Tie its f0 to the lobe's, as in `coupled_lambert(f0=kurt.f0) + kurt`; untied, it is a parameter of its own.
    """

    parameters = (
        KD,
        Parameter("f0", 0.04, 0.0, 1.0, "Fresnel reflectance of the coupled lobe [1]", per_channel="optional"),
    )

    @abstractmethod
    def transmitted(self, g: Geometry) -> Tensor:
        """The term for kd (1 - f0) = 1 [1/sr], (..., 1)."""

    def basis(self, values: Values, g: Geometry) -> tuple[Tensor, ...]:
        """What is left of the light after the Fresnel factor, without its colour."""
        return (self.transmitted(g),)

    def coefficients(self, values: Values) -> tuple[Tensor, ...]:
        """The product kd (1 - f0)."""
        return (values["kd"] * (1 - values["f0"]),)
