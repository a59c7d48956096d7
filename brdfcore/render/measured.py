"""A measured table as the plan leaves it: whole or not at all, since it has no terms, no options and no derivatives.

What a table reflects in all is no closed form: `albedos` are the means of its own samples, with four standard errors
added (energy/measured.py). So a bound that rests on them is an estimate, which the plan says; what a table reflects of
lights without an extent is evaluated, and bounded as any material's.
"""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from ..energy.measured import of_table
from ..tabulated import Tabulated
from .surfaces import Surface

LABEL = "measured"
FINEST = 1e-2  # of an albedo, that is asked for: what finer ones take is more than they would save
AZIMUTHS = 8  # over the whole turn: a table has no symmetry that could be relied on


@dataclass(frozen=True, eq=False)
class Measured:
    """A table, or black where it is `dropped`."""

    material: Tabulated
    dropped: bool = False

    @property
    def black(self) -> bool:
        """Whether nothing is left."""
        return self.dropped

    @property
    def count(self) -> int:
        """How many terms are evaluated."""
        return int(not self.dropped)

    @property
    def peak(self) -> float:
        """The largest f cos theta_i [1/sr], of which nothing is known between the nodes."""
        return 0.0 if self.dropped else math.inf

    def without(self, label: str) -> "Measured":
        """Nothing."""
        assert label == LABEL  # noqa: S101 - for the plan, which knows no other term of a table
        return Measured(self.material, dropped=True)

    def albedos(self, theta: Tensor, tolerance: float) -> Tensor:
        """Albedos [1] with the error claimed for them, (angles, azimuths, C), for theta [rad]."""
        if self.dropped:
            return torch.zeros(1, 1, 1, dtype=torch.float64)
        turn = torch.arange(1 if self.material.grid.isotropic else AZIMUTHS, dtype=torch.float64)
        values, error, _, _ = of_table(
            self.material, theta[:, None], turn * (2 * torch.pi / AZIMUTHS), max(tolerance, FINEST)
        )
        return values + error

    def reflected(self, wi: Tensor, wo: Tensor) -> Tensor:
        """The product f cos theta_i [1/sr], (..., C), as negative as the table is."""
        if self.dropped:
            return torch.zeros_like(wi[..., :1])
        return self.material.f(wi, wo) * wi[..., 2:].clamp(min=0)

    def pdf(self, wi: Tensor, wo: Tensor) -> Tensor:
        """The density of `sample` [1/sr], (...)."""
        return torch.zeros_like(wi[..., 0]) if self.dropped else self.material.pdf(wi, wo)

    def sample(self, wo: Tensor, u: Tensor) -> Tensor:
        """Directions wi (..., 3) for u (..., 3)."""
        return -wo if self.dropped else self.material.sample(wo, u)


AnySurface = Surface | Measured


def surface(material: object) -> AnySurface:
    """The surface of all of a material."""
    return Measured(material) if isinstance(material, Tabulated) else Surface(material)  # type: ignore[arg-type]
