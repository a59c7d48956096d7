"""Lawrence, Rusinkiewicz and Ramamoorthi's factored form of a measured isotropic BRDF: small, and made to be sampled.

    f(wi, wo) cos theta_i = sum over l of F_l(theta_o) u_l(theta_h) v_l(phi_h)                      [1/sr]
    pdf(wi) = sum over l of s_l u_l v_l / (4 h.wo),  s_l the share of term l seen from wo           [1/sr]

phi_h is the half vector's azimuth from wo's, and u_l v_l in the density is scaled to integrate to 1. All factors are
non-negative. F is linear between its nodes in theta_o and has a value a channel; u and v are constant in bins, of
sqrt(theta_h) and of |phi_h|. The matrix (theta_o, h) is factored into J terms, each one's h into K, and the L = J K
terms are then refined together. `error` is the relative root mean square of f cos theta_i over the matrix, weighed by
the solid angle of h and by sin theta_o cos theta_o; `kilobytes` counts single precision.
Source: Lawrence, Rusinkiewicz and Ramamoorthi 2004, "Efficient BRDF importance sampling using a factored
representation", ACM Transactions on Graphics 23(3). Departure: the channels are factored together, where the paper
factors intensity and colour apart; by alternating least squares, a column at a time, where it multiplies; weighed; and
the last step, which gives each of the L terms an F of its own. Diffuse light is what suits it least: its horizon is no
product of functions of theta_o and h.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import torch

from ..errors import InvalidValueError
from ._tabulated import Tabulated

Array = npt.NDArray[np.float64]

NODES, HEIGHTS, AZIMUTHS = 48, 90, 32  # of theta_o, sqrt(theta_h) and |phi_h|
STEEPEST = math.radians(88.0)  # the last node of theta_o; beyond it F is constant
SWEEPS = 150  # of the alternating least squares in each step


@dataclass(frozen=True)
class FactoredGrid:
    """The factors: F (NODES, C, L), u (HEIGHTS, L) and v (AZIMUTHS, L)."""

    outgoing: Array
    heights: Array
    azimuths: Array
    channels: tuple[str, ...]
    error: float
    isotropic: bool = True

    @property
    def kilobytes(self) -> float:
        """The size of all factors in single precision [kB]."""
        return 4 * (self.outgoing.size + self.heights.size + self.azimuths.size) / 1000

    def f(self, wi: Array, wo: Array) -> Array:
        """The BRDF (N, C) [1/sr]."""
        height, azimuth, _ = _bins(wi, wo)
        terms = self.heights[height] * self.azimuths[azimuth]
        found: Array = (self._outgoing(wo) * terms[:, None, :]).sum(-1) / wi[:, 2:]
        return found

    def _outgoing(self, wo: Array) -> Array:
        """F (N, C, L)."""
        place = np.clip(_elevation(wo) / STEEPEST, 0, 1) * (NODES - 1)
        low = np.minimum(place.astype(np.intp), NODES - 2)
        share = (place - low)[:, None, None]
        found: Array = (1 - share) * self.outgoing[low] + share * self.outgoing[low + 1]
        return found

    @cached_property
    def _shapes(self) -> tuple[Array, Array, Array]:
        """Probabilities of the bins of u (HEIGHTS, L) and v (AZIMUTHS, L), and the mass of each term (L,)."""
        u = self.heights * np.diff(-np.cos(_edges()))[:, None]
        v = self.azimuths * (2 * math.pi / AZIMUTHS)
        mass = u.sum(0) * v.sum(0)
        return _normalised(u), _normalised(v), mass

    def _shares(self, wo: Array) -> Array:
        """How often each term is drawn from (N, L)."""
        each = self._outgoing(wo).mean(1) * self._shapes[2]
        total = each.sum(1, keepdims=True)
        shares: Array = np.divide(each, total, out=np.full_like(each, 1 / each.shape[1]), where=total > 0)
        return shares

    def pdf(self, given: Array, drawn: Array) -> Array:
        """The density (N,) [1/sr]."""
        height, azimuth, cosine = _bins(drawn, given)
        u, v, _ = self._shapes
        solid = np.diff(-np.cos(_edges()))[height] * (2 * math.pi / AZIMUTHS)
        density: Array = (self._shares(given) * u[height] * v[azimuth]).sum(1) / (solid * 4 * cosine)
        return density

    def sample(self, given: Array, u: Array, v: Array) -> Array:
        """Directions (N, 3) that mirror the given ones; u chooses term and height, v the azimuth and its side."""
        term, left = _inverted(self._shares(given).T, u)
        heights, azimuths, _ = self._shapes
        height, within = _inverted(heights[:, term], left)
        side, v = np.where(v < 0.5, -1.0, 1.0), (2 * v) % 1.0
        azimuth, across = _inverted(azimuths[:, term], v)
        low, high = (np.cos(_edges())[height + k] for k in (0, 1))
        cosine = low + within * (high - low)
        phi = side * (azimuth + across) * math.pi / AZIMUTHS + np.arctan2(given[:, 1], given[:, 0])
        sine = np.sqrt(np.maximum(1 - cosine * cosine, 0))
        half = np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine], -1)
        mirrored: Array = 2 * (half * given).sum(-1, keepdims=True) * half - given
        return mirrored


def lawrence(table: Tabulated, outer: int = 4, inner: int = 2) -> Tabulated:
    """The factored form of an isotropic table, with J = `outer` terms of K = `inner` each; its `grid` has its size.

    Raises InvalidValueError for a table that was measured at several azimuths, and for no terms.
    """
    if not table.grid.isotropic:
        raise InvalidValueError(
            f"Expected the table to be isotropic, got {table}, measured at several azimuths. Fit it instead.",
            field="table",
        )
    for name, count in (("outer", outer), ("inner", inner)):
        if count < 1:
            raise InvalidValueError(f"Expected {name} to be at least 1, got {count}. Ask for more terms.", field=name)
    along_o, along_h = _weights(table.channels)
    values = _values(table) * along_o[:, None, None] * along_h[:, None]
    count = len(values)
    rows = values.reshape(count, -1)
    left, right = factorised(rows, outer)
    halves = [factorised(part.reshape(HEIGHTS, AZIMUTHS), inner) for part in right]
    u = np.concatenate([heights for heights, _ in halves], 1)
    v = np.concatenate([azimuths.T for _, azimuths in halves], 1)
    left = np.repeat(left, inner, axis=1)
    by_height, by_azimuth = (np.moveaxis(values, axis, 0).reshape(values.shape[axis], -1) for axis in (1, 2))
    for _ in range(SWEEPS):
        left = _columns(rows, left, _products(u, v))
        u = _columns(by_height, u, _products(left, v))
        v = _columns(by_azimuth, v, _products(left, u))
    error = math.sqrt(float(((rows - left @ _products(u, v)) ** 2).sum() / (rows**2).sum()))
    left, u = left / along_o[:, None], u / along_h[:, None]
    grid = FactoredGrid(left.reshape(NODES, table.channels, -1), u, v, table.channel_names, error)
    return Tabulated(grid, f"{table}, factored")


def _products(a: Array, b: Array) -> Array:
    """All products of the rows of a (N, L) and of b (M, L), as (L, N M)."""
    found: Array = np.einsum("nl,ml->lnm", a, b).reshape(a.shape[1], -1)
    return found


def _weights(channels: int) -> tuple[Array, Array]:
    """The roots of the weights of the rows (NODES C,) and of the bins of theta_h (HEIGHTS,)."""
    theta = np.maximum(np.linspace(0, STEEPEST, NODES), 0.25 * STEEPEST / (NODES - 1))  # a cap around the normal
    return np.repeat(np.sqrt(np.sin(theta) * np.cos(theta)), channels), np.sqrt(np.diff(-np.cos(_edges())))


def _values(table: Tabulated) -> Array:
    """The values f cos theta_i [1/sr] that are factored, (NODES C, HEIGHTS, AZIMUTHS); 0 below the horizon."""
    edges = _edges()
    theta_h, phi_h = 0.5 * (edges[1:] + edges[:-1]), (np.arange(AZIMUTHS) + 0.5) / AZIMUTHS * math.pi
    theta_o = np.linspace(0, STEEPEST, NODES)
    o, h, p = (a.ravel() for a in np.meshgrid(theta_o, theta_h, phi_h, indexing="ij"))
    half = np.stack([np.sin(h) * np.cos(p), np.sin(h) * np.sin(p), np.cos(h)], -1)
    wo = np.stack([np.sin(o), np.zeros_like(o), np.cos(o)], -1)
    wi = 2 * (half * wo).sum(-1, keepdims=True) * half - wo
    f = table.f(torch.from_numpy(wi), torch.from_numpy(wo)).numpy()
    values = np.maximum(f, 0) * np.maximum(wi[:, 2:], 0)
    found: Array = np.moveaxis(values.reshape(NODES, HEIGHTS, AZIMUTHS, -1), -1, 1)
    return found.reshape(-1, HEIGHTS, AZIMUTHS)


def factorised(matrix: Array, terms: int) -> tuple[Array, Array]:
    """Non-negative factors (N, terms) and (terms, M) whose product is nearest to a matrix (N, M), by a local search."""
    rng = np.random.default_rng(2004)
    left = rng.uniform(0.5, 1.5, (matrix.shape[0], terms)) * matrix.mean(1, keepdims=True)
    right = rng.uniform(0.5, 1.5, (terms, matrix.shape[1]))
    for _ in range(SWEEPS):
        right = _columns(matrix.T, right.T, left.T).T
        left = _columns(matrix, left, right)
    return left, right


def _columns(matrix: Array, left: Array, right: Array) -> Array:
    """The left factor after least squares for one column after the other, each clipped at 0 (hierarchical ALS)."""
    left, moments, gram = left.copy(), matrix @ right.T, right @ right.T
    for j in range(left.shape[1]):
        if gram[j, j] > 0:
            left[:, j] = np.maximum(left[:, j] + (moments[:, j] - left @ gram[:, j]) / gram[j, j], 0)
    return left


def _edges() -> Array:
    """The edges of the bins of theta_h [rad]."""
    found: Array = (np.arange(HEIGHTS + 1) / HEIGHTS) ** 2 * (math.pi / 2)
    return found


def _elevation(w: Array) -> Array:
    found: Array = np.arctan2(np.hypot(w[:, 0], w[:, 1]), w[:, 2])
    return found


def _bins(wi: Array, wo: Array) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp], Array]:
    """The bins of the half vector's theta_h and |phi_h|, and h.wo."""
    half = wi + wo
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    height = np.sqrt(_elevation(half) / (math.pi / 2)) * HEIGHTS
    phi = np.arctan2(half[:, 1], half[:, 0]) - np.arctan2(wo[:, 1], wo[:, 0])
    phi = np.abs((phi + math.pi) % (2 * math.pi) - math.pi) / math.pi * AZIMUTHS
    clipped = (np.clip(x.astype(np.intp), 0, n - 1) for x, n in ((height, HEIGHTS), (phi, AZIMUTHS)))
    height_bin, azimuth_bin = clipped
    return height_bin, azimuth_bin, (half * wo).sum(-1)


def _normalised(columns: Array) -> Array:
    """Columns that sum to 1; one that is all 0 becomes uniform."""
    total = columns.sum(0)
    found: Array = np.divide(columns, total, out=np.full_like(columns, 1 / len(columns)), where=total > 0)
    return found


def _inverted(probabilities: Array, u: Array) -> tuple[npt.NDArray[np.intp], Array]:
    """The row (N,) that u falls to of probabilities (rows, N), and where in it, in [0, 1)."""
    upper = np.cumsum(probabilities, 0)
    upper /= upper[-1]
    row = np.minimum((upper <= u).sum(0), len(upper) - 1)
    each = np.arange(len(u))
    width = probabilities[row, each]
    start = upper[row, each] - width
    share = np.divide(u - start, width, out=np.zeros_like(u), where=width > 0)
    return row, np.clip(share, 0, 1 - 2**-53)
