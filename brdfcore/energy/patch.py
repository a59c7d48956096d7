"""The largest albedo over a rectangle of directions, by polynomials through Chebyshev-Lobatto nodes.

As long as the polynomial's last coefficients are not small enough, a smaller rectangle about its largest value follows;
one whose largest value lies on its rim moves there first. A coordinate may be held.
"""

import functools
import math
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from .scan import Scan

DENSE = 65  # points along each coordinate at which the polynomial is looked at
ALONE, BOTH = 11, 7  # nodes of a coordinate, where the other one is held and where it is not
SHRINK, ROUNDS = 4.0, 5
SAFETY = 4.0  # of what a polynomial's last coefficients say that it lacks
DEAREST = 10**7  # evaluations of a scan after which its peaks stay as they are, and what is in doubt counts as error


class Peak(NamedTuple):
    """A largest albedo [1], its claimed error, and where it is."""

    albedo: float
    error: float
    u: float
    s: float
    channel: int


class Patch(NamedTuple):
    """A rectangle of u and s, given by its middle and half its sides; a half of 0 holds the coordinate."""

    u: float
    s: float
    half_u: float
    half_s: float

    def inside(self, scan: Scan) -> "Patch":
        """The patch, moved to where the scan is."""
        u = min(max(self.u, self.half_u), float(scan.u[-1]) - self.half_u)
        return self._replace(u=u, s=min(max(self.s, self.half_s), scan.turn - self.half_s))

    def covers(self, scan: Scan) -> Tensor:
        """The points of the scan (U, S) that lie in it."""
        near_u = (scan.u - self.u).abs() <= self.half_u * 1.001 + 1e-9
        near_s = (scan.s - self.s).abs() <= self.half_s * 1.001 + 1e-9
        return near_u.unsqueeze(-1) & near_s


class Grid(NamedTuple):
    """Nodes and dense points on [-1, 1], and what makes values at the latter, and modes, of values at the former."""

    nodes: Tensor
    dense: Tensor
    values: Tensor
    modes: Tensor


@functools.cache
def grid(count: int) -> Grid:
    """The grid of `count` nodes, 1 where the coordinate is held."""
    if count == 1:
        one = torch.ones(1, 1, dtype=torch.float64)
        return Grid(one[0] * 0, one[0] * 0, one, one)
    nodes = np.cos(math.pi * np.arange(count)[::-1] / (count - 1))
    dense = np.linspace(-1, 1, DENSE)
    terms = np.polynomial.chebyshev.chebvander
    modes = np.linalg.inv(terms(nodes, count - 1))
    return Grid(*(torch.tensor(x) for x in (nodes, dense, terms(dense, count - 1) @ modes, modes)))


def largest_index(table: Tensor) -> tuple[int, ...]:
    """The indices of the largest entry; the first of several."""
    return tuple(int(i) for i in np.unravel_index(int(table.argmax()), table.shape))


def largest(scan: Scan, patch: Patch, tolerance: float) -> Peak:
    """The largest albedo of a patch."""
    for _ in range(ROUNDS):
        count = BOTH if patch.half_u > 0 and patch.half_s > 0 else ALONE
        along, across = (grid(count if half > 0 else 1) for half in (patch.half_u, patch.half_s))
        u = (patch.u + patch.half_u * along.nodes).repeat_interleave(len(across.nodes))
        s = (patch.s + patch.half_s * across.nodes).repeat(len(along.nodes))
        parts, errors = scan.albedos(u, s, tolerance / 4)
        table = parts.sum(0).unflatten(0, (len(along.nodes), len(across.nodes)))
        peak, left, smaller = _top(patch, table, float(errors.sum(0).max()), (along, across), tolerance)
        if left <= tolerance / 4 or scan.evaluations > DEAREST:
            break
        patch = smaller.inside(scan)
    return peak


def _top(
    patch: Patch, table: Tensor, error: float, grids: tuple[Grid, Grid], tolerance: float
) -> tuple[Peak, float, Patch]:
    """The largest of the polynomials through a table (U, S, C), what they may lack, and the patch to look at next."""
    along, across = grids
    dense = torch.einsum("ui,sj,ijc->usc", along.values, across.values, table)
    modes = torch.einsum("ui,sj,ijc->usc", along.modes, across.modes, table).abs()
    left = SAFETY * sum(float(m[-2:].sum(0).max()) for m in (modes, modes.transpose(0, 1)) if len(m) > 1)
    # of equals the first, whatever the rounding
    rows, slack = dense.amax((1, 2)), min(max(1e-3 * tolerance, error), tolerance / 4)
    i = int((rows >= rows.max() - slack).to(torch.int8).argmax())
    j, c = largest_index(dense[i])
    rises, moves = zip(_vertex(dense[:, j, c], i), _vertex(dense[i, :, c], j), strict=True)
    u = patch.u + patch.half_u * (float(along.dense[i]) + moves[0])
    s = patch.s + patch.half_s * (float(across.dense[j]) + moves[1])
    half_u, half_s = (
        half / (1 if k in (0, DENSE - 1) else SHRINK) for half, k in ((patch.half_u, i), (patch.half_s, j))
    )
    return Peak(float(dense[i, j, c]) + sum(rises), error + left, u, s, c), left, Patch(u, s, half_u, half_s)


def _vertex(line: Tensor, i: int) -> tuple[float, float]:
    """How much higher the top of the parabola through a largest entry and its neighbours is, and where, on [-1, 1]."""
    if not 0 < i < len(line) - 1:
        return 0.0, 0.0
    low, middle, high = line[i - 1 : i + 2].tolist()
    bend = 2 * middle - low - high
    if bend <= 0 or max(low, high) > middle:
        return 0.0, 0.0
    share = (high - low) / bend
    return share * (high - low) / 8, share / (len(line) - 1)
