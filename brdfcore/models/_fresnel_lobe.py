"""A lobe under a reflectance and a Fresnel factor: f = ks F lobe.

`schlick`: F = f0 + (1 - f0) s, whose coefficients ks f0 and ks (1 - f0) are both linear. `constant`: F = 1, and neither
F nor h.wo is computed for it. `dielectric` and `conductor`: the exact reflectance of an index of refraction, which
shapes the basis, so that ks alone is linear; a basis has a column a channel where the index has one value a channel.
"""

from abc import abstractmethod
from typing import ClassVar

from torch import Tensor

from ..geometry import Geometry
from ..parameters import Parameter, Values
from ._half_vector import ISOTROPY, HalfVectorLobe, WidthLobe
from .fresnel import MEAN_SCHLICK, conductor, dielectric, schlick

FRESNEL = ("schlick", "constant", "dielectric", "conductor")
KS = Parameter("ks", 0.5, 0.0, 1.0, "specular reflectance [1]", per_channel="yes")
F0 = Parameter(
    "f0",
    0.04,
    0.0,
    1.0,
    "Fresnel reflectance where light meets the microfacets at normal incidence [1]",
    per_channel="optional",
)
ETA = Parameter(
    "eta",
    1.5,
    1.0001,  # at 1 there is no surface to see, and no derivative to leave it by
    4.0,
    "relative index of refraction [1]",
    search=(1.2, 2.5),
    per_channel="optional",
)
CONDUCTOR = (
    Parameter(
        "eta",
        1.0,
        0.01,
        20.0,
        "real part of the index of refraction [1]",
        search=(0.1, 5.0),
        scale="log",
        per_channel="optional",
    ),
    Parameter("k", 4.0, 0.0, 20.0, "extinction coefficient [1]", search=(0.5, 8.0), per_channel="optional"),
)
# Cosine-weighted means of F over the hemisphere, for the default indices.
MEAN_DIELECTRIC = 0.0918
MEAN_CONDUCTOR = 0.792


class FresnelTerm(WidthLobe):
    """A lobe that a specular reflectance and, unless `constant`, a Fresnel factor multiply."""

    option_groups: ClassVar[tuple[tuple[str, ...], ...]] = (ISOTROPY, FRESNEL)
    scale = "ks"
    shape: ClassVar[tuple[Parameter, ...]] = ()  # parameters of the lobe beside its widths
    lobe_needs: ClassVar[tuple[str, ...]] = ()

    @property
    def fresnel(self) -> bool:
        """Whether the lobe's reflectance depends on h.wo."""
        return "constant" not in self.options

    @property
    def exact(self) -> bool:
        """Whether that is the exact reflectance of an index of refraction."""
        return "dielectric" in self.options or "conductor" in self.options

    @property
    def reflectances(self) -> tuple[Parameter, ...]:
        """The declared reflectance, and what makes the Fresnel factor."""
        if "conductor" in self.options:
            return (KS, *CONDUCTOR)
        if "dielectric" in self.options:
            return (KS, ETA)
        return (KS, F0) if self.fresnel else (KS,)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Reflectances, widths and what else shapes the lobe."""
        return (*self.reflectances, *self.width_parameters, *self.shape)

    @abstractmethod
    def lobe(self, values: Values, g: Geometry) -> Tensor:
        """The lobe for ks F = 1 [1/sr], (..., 1)."""

    def basis(self, values: Values, g: Geometry) -> tuple[Tensor, ...]:
        """The lobe and the lobe times Schlick's s, or the lobe times an exact F, or the lobe alone."""
        lobe = self.lobe(values, g)
        if "conductor" in self.options:
            return (lobe * conductor(g.h_dot_wo, values["eta"], values["k"]),)
        if "dielectric" in self.options:
            return (lobe * dielectric(g.h_dot_wo, values["eta"]),)
        return (lobe, lobe * schlick(g.h_dot_wo)) if self.fresnel else (lobe,)

    def coefficients(self, values: Values) -> tuple[Tensor, ...]:
        """The products ks f0 and ks (1 - f0), or ks alone."""
        ks = values["ks"]
        return (ks * values["f0"], ks * (1 - values["f0"])) if self.fresnel and not self.exact else (ks,)

    @property
    def typical_albedo(self) -> tuple[float, ...]:
        """1 for the lobe, and the cosine-weighted mean of its factor for the lobe under s or F."""
        if "conductor" in self.options:
            return (MEAN_CONDUCTOR,)
        if "dielectric" in self.options:
            return (MEAN_DIELECTRIC,)
        return (1.0, MEAN_SCHLICK) if self.fresnel else (1.0,)


class FresnelLobe(FresnelTerm, HalfVectorLobe):
    """Such a lobe, sampled by its half vector."""
