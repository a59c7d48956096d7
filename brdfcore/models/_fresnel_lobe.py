"""A lobe under a reflectance and a Fresnel factor: f = ks F lobe, with F = f0 + (1 - f0) s, or F = 1.

Both coefficients, ks f0 and ks (1 - f0), are linear, and the option `constant` computes neither F nor h.wo for it.
"""

from abc import abstractmethod
from typing import ClassVar

from torch import Tensor

from ..geometry import Geometry
from ..parameters import Parameter, Values
from ._half_vector import ISOTROPY, HalfVectorLobe
from .fresnel import MEAN_SCHLICK, schlick


class FresnelLobe(HalfVectorLobe):
    """A half-vector lobe that a specular reflectance and, unless `constant`, Schlick's Fresnel factor multiply."""

    option_groups: ClassVar[tuple[tuple[str, ...], ...]] = (ISOTROPY, ("schlick", "constant"))
    scale = "ks"
    shape: ClassVar[tuple[Parameter, ...]] = ()  # parameters of the lobe beside its widths
    lobe_needs: ClassVar[tuple[str, ...]] = ()

    @property
    def fresnel(self) -> bool:
        """Whether the lobe's reflectance rises towards grazing half-vector angles."""
        return "constant" not in self.options

    @property
    def reflectances(self) -> tuple[Parameter, ...]:
        """The declared reflectances."""
        ks = Parameter("ks", 0.5, 0.0, 1.0, "specular reflectance [1]", per_channel="yes")
        return (ks, F0) if self.fresnel else (ks,)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Reflectances, widths and what else shapes the lobe."""
        return (*self.reflectances, *self.width_parameters, *self.shape)

    @abstractmethod
    def lobe(self, values: Values, g: Geometry) -> Tensor:
        """The lobe for ks F = 1 [1/sr], (..., 1)."""

    def basis(self, values: Values, g: Geometry) -> tuple[Tensor, ...]:
        """The lobe, and the lobe times Schlick's s."""
        lobe = self.lobe(values, g)
        return (lobe, lobe * schlick(g.h_dot_wo)) if self.fresnel else (lobe,)

    def coefficients(self, values: Values) -> tuple[Tensor, ...]:
        """The products ks f0 and ks (1 - f0), or ks alone."""
        ks = values["ks"]
        return (ks * values["f0"], ks * (1 - values["f0"])) if self.fresnel else (ks,)

    @property
    def typical_albedo(self) -> tuple[float, ...]:
        """1 for the lobe, and the cosine-weighted mean of s for the lobe times s."""
        return (1.0, MEAN_SCHLICK) if self.fresnel else (1.0,)


F0 = Parameter(
    "f0",
    0.04,
    0.0,
    1.0,
    "Fresnel reflectance where light meets the microfacets at normal incidence [1]",
    per_channel="optional",
)
