"""Oren and Nayar's rough diffuse reflection, in its qualitative or an energy-preserving form.

    f(wi, wo) = kd / pi (A + B max(t, 0))                                                   [1/sr]
    A = 1 - 0.5 sigma^2 / (sigma^2 + 0.33),  B = 0.45 sigma^2 / (sigma^2 + 0.09)
    t = s / max(ci, co) where s > 0, else s;  s = xi xo + yi yo = cos(phi_i - phi_o) sin theta_i sin theta_o

    `energy_preserving`, with r = 2 sigma / pi:
    f = kd / pi A' (1 + r t) + kd' / pi (1 - E(ci)) (1 - E(co)) / (1 - e)
    A' = 1 / (1 + (1/2 - 2/(3 pi)) r),  e = A' (1 + (2/3 - 28/(15 pi)) r),  kd' = kd^2 e / (1 - kd (1 - e))
    E(cos theta) = A' (1 + r G / pi),  G = sin theta (theta - sin theta cos theta - 2/3)
                                           + 2/3 tan theta (1 - sin^3 theta)

kd, diffuse reflectance [1] (of one facet, once, where energy-preserving); sigma, standard deviation of the facets'
slope angle [rad].
Options: `qualitative` (1994, single reflection), `energy_preserving` (2025, all reflections).
Box: kd in [0, 1]; sigma in [0, pi/2].
Reciprocal; sigma = 0 is Lambert's. Qualitative, the directional albedo falls from kd (A + B/2) at grazing to kd A at
normal incidence: below sigma = 0.326 it exceeds kd towards grazing, by 1.5 % at sigma = 0.2; rougher, it loses up to
44 %. Energy-preserving, it is kd E + kd' (1 - E), at most kd, and 1 for kd = 1.
Source: Oren and Nayar 1994, "Generalization of Lambert's reflectance model", eq. 30; Portsmouth, Kutz and Hill 2025,
"EON: A practical energy-preserving rough diffuse BRDF", Journal of Computer Graphics Techniques 14(1), listing 1 with
the exact E, after Fujii's t. Departure: r, a roughness in [0, 1] in that paper, is tied to sigma so that both forms
share one box; cosine-sampled, without their clipped linear transform; 1 - E is evaluated so that nothing cancels
towards grazing, where it goes to 0 like cos theta, so their epsilons are gone.
"""

import math

import torch
from torch import Tensor

from ..geometry import Geometry
from ..parameters import Parameter, Values
from ._diffuse import KD, CosineSampled

_C1 = 1 / 2 - 2 / (3 * math.pi)
_C2 = 2 / 3 - 28 / (15 * math.pi)


def _lost(mu: Tensor) -> Tensor:
    """The share pi/2 - 2/3 - G that (1 - E) pi / (A' r) is [1], at a cosine; without cancelling as it goes to 0.

    It is w + mu (s^2/3 - 2/3 (mu + s)/(1 + s)) with w = pi/2 - s theta, s = sin theta.
    """
    s2 = (1 - mu) * (1 + mu)
    s = torch.sqrt(s2.clamp(min=torch.finfo(mu.dtype).tiny))
    steep = math.pi / 2 - s2 * (torch.atan2(s, mu) / s)
    grazing = math.pi / 2 * mu.square() / (1 + s) + s * torch.atan2(mu, s)
    return torch.where(mu > 0.5, steep, grazing) + mu * (s2 / 3 - 2 / 3 * (mu + s) / (1 + s))


class OrenNayar(CosineSampled):
    """A diffuse term of V-shaped grooves."""

    name = "oren_nayar"
    good_for = "Rough matt surfaces such as clay, sand and cloth, which look flat and bright to the rim."
    option_groups = (("qualitative", "energy_preserving"),)
    parameters = (
        KD,
        Parameter("sigma", 0.3, 0.0, math.pi / 2, "standard deviation of the facets' slope angle [rad]"),
    )

    @property
    def energy_preserving(self) -> bool:
        """Whether light that leaves a groove after several reflections counts."""
        return "energy_preserving" in self.options

    @property
    def scale(self) -> str:
        """The reflectance kd, of which only the qualitative form is a multiple."""
        return "" if self.energy_preserving else "kd"

    @property
    def needs(self) -> frozenset[str]:
        """The quantities of the geometry that the bases read."""
        cosines = {"ci", "co"} if self.energy_preserving else set()
        return frozenset({"xi", "yi", "xo", "yo", "over_ci", "over_co"} | cosines)

    @property
    def typical_albedo(self) -> tuple[float, ...]:
        """About 1 for a single reflection, and what a middling roughness leaves to the others."""
        return (1.0, 0.1) if self.energy_preserving else (1.0,)

    def basis(self, values: Values, g: Geometry) -> tuple[Tensor, ...]:
        """Light reflected once, and where it is energy-preserving, more often."""
        sigma = values["sigma"]
        s = g.xi * g.xo + g.yi * g.yo
        over_max = torch.minimum(g.over_ci, g.over_co)
        if not self.energy_preserving:
            sigma2 = sigma.square()
            a, b = 1 - 0.5 * sigma2 / (sigma2 + 0.33), 0.45 * sigma2 / (sigma2 + 0.09)
            return ((a + b * s.clamp(min=0) * over_max) / math.pi,)
        r = 2 / math.pi * sigma
        a = 1 / (1 + _C1 * r)
        once = a / math.pi * (1 + r * torch.where(s > 0, s * over_max, s)).clamp(min=0)
        often = a * r / (math.pi**3 * (_C1 - _C2)) * _lost(g.ci) * _lost(g.co)
        return once, often

    def coefficients(self, values: Values) -> tuple[Tensor, ...]:
        """The reflectance kd, and where it is energy-preserving, kd' of the further reflections."""
        kd = values["kd"]
        if not self.energy_preserving:
            return (kd,)
        r = 2 / math.pi * values["sigma"]
        lost = (_C1 - _C2) * r / (1 + _C1 * r)  # 1 - e
        return kd, kd.square() * (1 - lost) / (1 - kd * lost)
