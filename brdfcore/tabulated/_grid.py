"""What a grid of measurements has to know, so that it can be a material."""

from typing import Protocol

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class Grid(Protocol):
    """A measured grid; directions are unit vectors (N, 3) above the horizon, in double precision."""

    @property
    def channels(self) -> tuple[str, ...]:
        """The names of the channels."""

    @property
    def isotropic(self) -> bool:
        """Whether the sample was measured at one azimuth."""

    def f(self, wi: Array, wo: Array) -> Array:
        """The BRDF (N, C) [1/sr]."""

    def pdf(self, given: Array, drawn: Array) -> Array:
        """The density (N,) [1/sr] with which `sample` draws a direction for a given one."""

    def sample(self, given: Array, u: Array, v: Array) -> Array:
        """Directions (N, 3) for given ones and u, v (N,) in [0, 1); below the horizon where none is to be had."""
