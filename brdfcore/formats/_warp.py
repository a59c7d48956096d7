"""Tables over the unit square that depend on further parameters, and the warps that they are densities of.

A table is bilinear between its nodes, which lie at k / (n - 1), and linear in its parameters. As a density it is
normalised at each parameter; `sample` inverts first the marginal over rows and then the row's cumulative distribution,
and `invert` is its inverse. Blends of distributions blend the tables of both cumulative distributions.
Source: Dupuy and Jakob 2018, section 4; their brdf-loader's Marginal2D.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Corners:
    """Which slices of a table a parameter lies between, (N, K), and how much of each, (N, K)."""

    slices: npt.NDArray[np.intp]
    weights: Array

    @classmethod
    def between(cls, axes: list[Array], points: list[Array]) -> "Corners":
        """The corners for values (N,), one array an axis; the last axis varies fastest, values beyond are clamped."""
        slices, weights = np.zeros((len(points[0]), 1), dtype=np.intp), np.ones((len(points[0]), 1))
        for axis, point in zip(axes, points, strict=True):
            if len(axis) == 1:
                continue
            low = np.clip(np.searchsorted(axis, point, side="right") - 1, 0, len(axis) - 2)
            share = np.clip((point - axis[low]) / (axis[low + 1] - axis[low]), 0, 1)[:, None]
            slices = np.concatenate([slices * len(axis) + low[:, None], slices * len(axis) + low[:, None] + 1], 1)
            weights = np.concatenate([weights * (1 - share), weights * share], 1)
        return cls(slices, weights)


@dataclass(frozen=True)
class Table:
    """Values (S, H, W) at the nodes of the unit square, for S parameters; the square's x is along W."""

    values: Array

    def __call__(self, x: Array, y: Array, at: Corners) -> Array:
        """The bilinear value (N,)."""
        row, fy = _cell(y, self.values.shape[1])
        column, fx = _cell(x, self.values.shape[2])
        found = np.zeros(len(x))
        for dy, wy in ((0, 1 - fy), (1, fy)):
            for dx, wx in ((0, 1 - fx), (1, fx)):
                node = self.values[at.slices, (row + dy)[:, None], (column + dx)[:, None]]
                found += wy * wx * (at.weights * node).sum(1)
        return found


@dataclass(frozen=True)
class Warp:
    """A table as densities of the unit square."""

    table: Array

    @cached_property
    def _scaled(self) -> tuple[Array, Array, Array]:
        """Nodes, cumulative rows and cumulative marginal, scaled so that the marginal ends at 1; cells have area 1."""
        nodes = self.table
        rows = np.zeros_like(nodes)
        rows[..., 1:] = np.cumsum(0.5 * (nodes[..., 1:] + nodes[..., :-1]), -1)
        marginal = np.zeros(nodes.shape[:2])
        marginal[:, 1:] = np.cumsum(0.5 * (rows[:, 1:, -1] + rows[:, :-1, -1]), -1)
        total = marginal[:, -1]
        return nodes / total[:, None, None], rows / total[:, None, None], marginal / total[:, None]

    @property
    def _cells(self) -> int:
        height, width = self.table.shape[1:]
        return int((height - 1) * (width - 1))

    def density(self, x: Array, y: Array, at: Corners) -> Array:
        """The density (N,) with which `sample` returns x, y."""
        return Table(self._scaled[0])(x, y, at) * self._cells

    def invert(self, x: Array, y: Array, at: Corners) -> tuple[Array, Array, Array]:
        """u, v of which `sample` makes x, y, and the density there."""
        nodes, rows, marginal = self._scaled
        row, fy = _cell(y, nodes.shape[1])
        column, fx = _cell(x, nodes.shape[2])
        r0, r1 = (self._blend(rows[at.slices, (row + k)[:, None], -1], at) for k in (0, 1))
        v = fy * (r0 + 0.5 * fy * (r1 - r0)) + self._blend(marginal[at.slices, row[:, None]], at)
        c0, c1, start = (
            (1 - fy) * self._blend(of[at.slices, row[:, None], k[:, None]], at)
            + fy * self._blend(of[at.slices, (row + 1)[:, None], k[:, None]], at)
            for of, k in ((nodes, column), (nodes, column + 1), (rows, column))
        )
        whole = (1 - fy) * r0 + fy * r1
        along = start + fx * (c0 + 0.5 * fx * (c1 - c0))
        u = np.divide(along, whole, out=np.zeros_like(along), where=whole > 0)
        return u, v, ((1 - fx) * c0 + fx * c1) * self._cells

    def sample(self, u: Array, v: Array, at: Corners) -> tuple[Array, Array, Array]:
        """x, y (N,) drawn for u, v in [0, 1], and the density there."""
        nodes, rows, marginal = self._scaled
        height, width = nodes.shape[1:]
        blended = (at.weights[..., None] * marginal[at.slices]).sum(1)
        row = np.clip((blended[:, 1:] <= v[:, None]).sum(1), 0, height - 2)
        each = np.arange(len(u))
        r0, r1 = (self._blend(rows[at.slices, (row + k)[:, None], -1], at) for k in (0, 1))
        fy = _root(v - blended[each, row], r0, r1)
        line, values = (
            (1 - fy)[:, None] * (at.weights[..., None] * of[at.slices, row[:, None]]).sum(1)
            + fy[:, None] * (at.weights[..., None] * of[at.slices, (row + 1)[:, None]]).sum(1)
            for of in (rows, nodes)
        )
        wanted = u * line[:, -1]
        column = np.clip((line[:, 1:] <= wanted[:, None]).sum(1), 0, width - 2)
        c0, c1 = values[each, column], values[each, column + 1]
        fx = _root(wanted - line[each, column], c0, c1)
        return (column + fx) / (width - 1), (row + fy) / (height - 1), ((1 - fx) * c0 + fx * c1) * self._cells

    @staticmethod
    def _blend(values: Array, at: Corners) -> Array:
        found: Array = (at.weights * values).sum(1)
        return found


def _cell(x: Array, nodes: int) -> tuple[npt.NDArray[np.intp], Array]:
    """The cell that holds a place in [0, 1], and where in it."""
    scaled = np.clip(x, 0, 1) * (nodes - 1)
    cell = np.minimum(scaled.astype(np.intp), nodes - 2)
    return cell, scaled - cell


def _root(mass: Array, a: Array, b: Array) -> Array:
    """The t in [0, 1] of a t + (b - a) t^2 / 2 = mass, the form of which nothing cancels."""
    inside = np.sqrt(np.maximum(a * a + 2 * mass * (b - a), 0))
    below = a + inside
    return np.clip(np.divide(2 * mass, below, out=np.zeros_like(mass), where=below > 0), 0, 1)
