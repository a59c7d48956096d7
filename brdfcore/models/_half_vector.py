"""What every lobe around the half vector shares: its width options, and for most of them sampling by the half vector.

Both width layouts are one lobe: isotropic declares and evaluates a single width, anisotropic one along x and one along
y. wi = reflect(wo, h) for a half vector h that is drawn from the lobe whatever wo is.
"""

from abc import abstractmethod
from dataclasses import replace
from typing import ClassVar

from torch import Tensor

from ..geometry import Geometry, reflect
from ..parameters import Parameter, Values
from .base import Model

ISOTROPY = ("isotropic", "anisotropic")


def slope_width(description: str) -> Parameter:
    """A width of a distribution of slopes [1]."""
    return Parameter("a", 0.1, 1e-4, 10.0, description, search=(0.005, 1.5), scale="log")


class WidthLobe(Model):
    """A lobe with one width or two."""

    option_groups: ClassVar[tuple[tuple[str, ...], ...]] = (ISOTROPY,)
    widths_along: ClassVar[tuple[str, str, str]] = ("a", "ax", "ay")  # the width's names: isotropic, along x, along y
    width: ClassVar[Parameter]  # what they have in common; its description is without the unit

    def log_slopes(self, values: Values, g: Geometry) -> dict[str, Tensor]:
        """The derivatives of the lobe's logarithm, by name, each (..., 1), for float64.

        Where all that shape a lobe are here, fits multiply the lobe by them; elsewhere they differentiate the basis.
        """
        return {}

    @property
    def anisotropic(self) -> bool:
        """Whether the two principal directions have widths of their own."""
        return "anisotropic" in self.options

    @property
    def width_names(self) -> tuple[str, ...]:
        """The names of the width parameters that the options declare."""
        return self.widths_along[1:] if self.anisotropic else self.widths_along[:1]

    def widths(self, values: Values) -> tuple[Tensor, Tensor]:
        """The widths along x and along y."""
        return values[self.width_names[0]], values[self.width_names[-1]]

    @property
    def width_parameters(self) -> tuple[Parameter, ...]:
        """The declared width or widths."""
        along = dict(zip(self.widths_along, ("", " along x", " along y"), strict=True))
        return tuple(
            replace(self.width, name=name, description=f"{self.width.description}{along[name]} [1]")
            for name in self.width_names
        )


class HalfVectorLobe(WidthLobe):
    """A lobe sampled by its half vector."""

    @abstractmethod
    def slopes(self, values: Values, u: Tensor) -> tuple[Tensor, Tensor]:
        """Slopes p, q (..., 1) of half vectors drawn from the lobe, for u (..., 2)."""

    @abstractmethod
    def half_vector_density(self, values: Values, g: Geometry) -> Tensor:
        """The density of `slopes`, per solid angle of the half vector [1/sr], (..., 1)."""

    def sample(self, values: Values, wo: Tensor, u: Tensor) -> Tensor:
        """Directions wi (..., 3); one below the horizon is part of the density's lost share and weighs 0."""
        return reflect(wo, *self.slopes(values, u))

    def pdf(self, values: Values, g: Geometry) -> Tensor:
        """p_h / (4 h.wo) [1/sr] (Walter 2005 eq. 8, Ashikhmin and Shirley techreport eq. 20)."""
        return 0.25 * self.half_vector_density(values, g) * g.over_h_dot_wo
