"""A MERL table as a grid: trilinear between the centres of its valid bins, sampled by its half vectors.

    p_h(theta_h) = D cos theta_h / (2 pi integral of D cos sin dtheta_h),  pdf = p_h / (4 h.w)         [1/sr]

D is the table's mean over the valid bins of each theta_h, all channels together, each bin weighted by sin theta_d
cos theta_d. Interpolation is along sqrt(theta_h), theta_d and phi_d, the last periodic; invalid bins do not count, and
where all eight are invalid f is 0. Departure from the database's BRDFRead.cpp, which takes the nearest bin.
"""

import itertools
import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..formats import merl

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class MerlGrid:
    """The table's values (bins, 3) [1/sr], negative where invalid."""

    values: Array
    channels: tuple[str, ...] = ("r", "g", "b")
    isotropic: bool = True

    @classmethod
    def load(cls, path: Path) -> "MerlGrid":
        """The grid of a file; FormatError where it is not whole."""
        stored = merl.stored_values(path)
        values = stored.T * np.array(merl.SCALE)
        values[(stored < 0).any(0)] = -1.0
        return cls(values)

    def f(self, wi: Array, wo: Array) -> Array:
        """The BRDF (N, 3) [1/sr]."""
        low, share = [], []
        for place, size, periodic in zip(merl.coordinates(wi, wo), merl.SHAPE, (False, False, True), strict=True):
            place = place - 0.5 if periodic else np.clip(place - 0.5, 0, size - 1)
            low.append(np.floor(place).astype(np.intp))
            share.append(place - low[-1])
        total, weights = np.zeros((len(wi), 3)), np.zeros(len(wi))
        for corner in itertools.product((0, 1), repeat=3):
            i, j, k = (index + step for index, step in zip(low, corner, strict=True))
            i, j, k = np.minimum(i, merl.SHAPE[0] - 1), np.minimum(j, merl.SHAPE[1] - 1), k % merl.SHAPE[2]
            value = self.values[(i * merl.SHAPE[1] + j) * merl.SHAPE[2] + k]
            weight = math.prod(s if step else 1 - s for s, step in zip(share, corner, strict=True))
            weight = weight * (value[:, 0] >= 0)
            total += weight[:, None] * value
            weights += weight
        return np.divide(total, weights[:, None], out=np.zeros_like(total), where=weights[:, None] > 0)

    @cached_property
    def _heights(self) -> tuple[Array, Array]:
        """D a bin of theta_h, normalised so that p_h is D cos theta_h; and its cumulative mass at the bins' edges."""
        theta_d = (np.arange(merl.SHAPE[1]) + 0.5) / merl.SHAPE[1] * math.pi / 2
        mean = self.values.mean(-1).reshape(merl.SHAPE)
        weight = np.where(mean >= 0, (np.sin(theta_d) * np.cos(theta_d))[:, None], 0.0)
        count = weight.sum((1, 2))
        mass = np.divide((weight * mean).sum((1, 2)), count, out=np.zeros_like(count), where=count > 0)
        mass = np.maximum(mass, 1e-6 * mass.max() or 1.0)
        cumulative = np.concatenate([[0.0], np.cumsum(mass * math.pi * np.diff(self._squares))])
        return mass / cumulative[-1], cumulative / cumulative[-1]

    @cached_property
    def _squares(self) -> Array:
        """The squared sine of theta_h at the bins' edges."""
        edges = (np.arange(merl.SHAPE[0] + 1) / merl.SHAPE[0]) ** 2 * math.pi / 2
        found: Array = np.sin(edges) ** 2
        return found

    def pdf(self, given: Array, drawn: Array) -> Array:
        """The density (N,) [1/sr]."""
        half = given + drawn
        half /= np.linalg.norm(half, axis=-1, keepdims=True)
        square = np.minimum(half[:, 0] ** 2 + half[:, 1] ** 2, 1.0)
        at = np.clip(np.searchsorted(self._squares, square, side="right") - 1, 0, merl.SHAPE[0] - 1)
        density: Array = self._heights[0][at] * half[:, 2] / (4 * (half * given).sum(-1))
        return density

    def sample(self, given: Array, u: Array, v: Array) -> Array:
        """Directions (N, 3) that mirror the given ones."""
        cumulative = self._heights[1]
        at = np.clip(np.searchsorted(cumulative, u, side="right") - 1, 0, merl.SHAPE[0] - 1)
        share = (u - cumulative[at]) / (cumulative[at + 1] - cumulative[at])
        square = self._squares[at] + share * (self._squares[at + 1] - self._squares[at])
        sine, phi = np.sqrt(square), 2 * math.pi * v
        half = np.stack([sine * np.cos(phi), sine * np.sin(phi), np.sqrt(1 - square)], -1)
        mirrored: Array = 2 * (half * given).sum(-1, keepdims=True) * half - given
        return mirrored
