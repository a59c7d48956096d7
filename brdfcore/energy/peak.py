"""Where a scanned albedo is largest, and where it exceeds 1.

Around the best points of the scan the albedo is interpolated by polynomials through Chebyshev-Lobatto nodes, first over
the neighbouring steps, then over a small part of them.
"""

import functools
import math
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import max_pool2d

from .scan import STEEP, STEP_S, STEP_STEEP, STEP_U, Scan, azimuth_of, theta_of

CANDIDATES = 2
COARSE = 1e-5  # tolerance of a scan whose best points are to be refined
COMPETES = 0.95  # of the best, as a share: between two steps of the scan an albedo rises by less than the rest
NODES, DENSE = 9, 65  # of a patch along each coordinate, and the points at which its polynomial is looked at
SHRINK = 16.0  # from the first patch to the second, whose points are then 7e-4 apart


class Peak(NamedTuple):
    """A largest albedo [1], its claimed error, and where it is."""

    albedo: float
    error: float
    u: float
    phi: float  # [rad]
    channel: int


@functools.cache
def _interpolation() -> tuple[Tensor, Tensor, Tensor]:
    """The nodes and the dense points on [-1, 1], and the matrix from values at the former to values at the latter."""
    nodes = np.cos(math.pi * np.arange(NODES)[::-1] / (NODES - 1))
    dense = np.linspace(-1, 1, DENSE)
    cheb = np.polynomial.chebyshev.chebvander
    matrix = cheb(dense, NODES - 1) @ np.linalg.inv(cheb(nodes, NODES - 1))
    return torch.tensor(nodes), torch.tensor(dense), torch.tensor(matrix)


def largest_index(table: Tensor) -> tuple[int, ...]:
    """The indices of the largest entry; the first of several."""
    return tuple(int(i) for i in np.unravel_index(int(table.argmax()), table.shape))


def highest(scan: Scan, total: Tensor) -> Peak:
    """The largest albedo of a scan (U, S, C) itself, whose error is what lies between its points: unknown."""
    row, column, channel = largest_index(total)
    where = float(scan.u[row]), float(azimuth_of(scan.s[column])), channel
    return Peak(float(total[row, column, channel]), math.inf, *where)


def refined(scan: Scan, total: Tensor, tolerance: float) -> tuple[Peak, Peak]:
    """The largest albedo near the best points of a scan (U, S, C), all finite, and the largest of its last row.

    Of places that are as high, within what is claimed of their errors, the one nearest to the normal is taken.
    """
    over = total.amax(-1)
    tops = (over == max_pool2d(over.unsqueeze(0), 3, 1, 1).squeeze(0)) & (over >= COMPETES * over.max())
    order = torch.where(tops, over, -math.inf).flatten().topk(min(CANDIDATES, int(tops.sum()))).indices
    level = int(torch.nonzero((over >= over.max() - COARSE).any(1))[0])
    u = torch.stack([*scan.u[order // len(scan.s)], scan.u[level], scan.u[-1]])
    s = torch.stack([*scan.s[order % len(scan.s)], scan.s[over[level].argmax()], scan.s[over[-1].argmax()]])
    step = torch.where(u < STEEP, STEP_U, STEP_STEEP)
    nodes, dense, matrix = _interpolation()
    for half_u, half_s in ((step, STEP_S), (step / SHRINK, STEP_S / SHRINK)):
        u = torch.minimum(torch.maximum(u, half_u), scan.u[-1] - half_u)
        s = s.clamp(half_s, scan.turn - half_s) if scan.turn else s
        across = (s.unsqueeze(-1) + half_s * nodes) if scan.turn else s.unsqueeze(-1)
        parts, errors = scan.albedos(u.unsqueeze(-1) + half_u.unsqueeze(-1) * nodes, across, tolerance / 4)
        patches = torch.einsum("ij,qjsc->qisc", matrix, parts.sum(0))
        patches = torch.einsum("ij,qujc->quic", matrix, patches) if scan.turn else patches
        errors = errors.sum(0)
        slack = errors.flatten(1).amax(1).clamp(1e-3 * tolerance, tolerance / 4).tolist()
        at = [_first(*each) for each in zip(patches, slack, strict=True)]
        at[-1] = (DENSE - 1, *largest_index(patches[-1, -1]))
        u = u + half_u * dense[[i for i, _, _ in at]]
        s = s + half_s * dense[[j for _, j, _ in at]] if scan.turn else s

    def found(q: int) -> Peak:
        i, j, c = at[q]
        near = patches[q, max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2, c]
        # the top of a parabola lies above its largest sample by at most a quarter of the drop to the next
        error = float(errors[q].max() + (near.max() - near.min()) / 4)
        return Peak(float(near.max()), error, float(u[q]), float(azimuth_of(s[q])), c)

    inner = [found(q) for q in range(len(u) - 1)]
    best = max(inner, key=lambda peak: peak.albedo)
    equal = [peak for peak in inner if peak.albedo >= best.albedo - min(best.error + peak.error, tolerance)]
    first = min(equal, key=lambda peak: peak.u)
    return best._replace(u=first.u, phi=first.phi, channel=first.channel), found(len(u) - 1)


def _first(patch: Tensor, slack: float) -> tuple[int, ...]:
    """The indices of the largest entry of the first row of (U, S, C) that comes within the slack of the largest."""
    rows = patch.amax((1, 2))
    row = int((rows >= rows.max() - slack).to(torch.int8).argmax())
    return (row, *largest_index(patch[row]))


def exceeding(scan: Scan, total: Tensor, top: Peak, tolerance: float) -> tuple[float, float]:
    """The first and the last polar angle [rad] at which some albedo exceeds 1, for a scan (U, S, C) and its peak.

    Both are pi/2 where that is closer to the horizon than the scan comes.
    """
    u = torch.cat([scan.u, scan.u.new_tensor([top.u])])
    over = torch.cat([total.amax((1, 2)), total.new_tensor([top.albedo])])
    order = u.argsort(stable=True)
    u, hot = u[order], torch.nonzero(over[order] > 1 + tolerance)[:, 0]
    if not len(hot):
        return math.pi / 2, math.pi / 2
    first, last = int(hot[0]), int(hot[-1])
    begin = 0.0 if first == 0 else theta_of(_crossing(scan, u[first - 1], u[first], tolerance))
    if last == len(u) - 1:
        return begin, math.pi / 2
    return begin, theta_of(_crossing(scan, u[last + 1], u[last], tolerance))


def _crossing(scan: Scan, below: Tensor, above: Tensor, tolerance: float) -> float:
    """The u at which the largest albedo over azimuths and channels crosses 1, between one below and one above."""
    share = torch.linspace(0, 1, NODES, dtype=torch.float64)
    for _ in range(2):
        u = below + (above - below) * share
        over = scan.albedos(u, scan.s, tolerance / 4)[0].sum(0).amax((1, 2))
        k = max(1, int((over > 1).to(torch.int8).argmax()))
        below, above, low, high = u[k - 1], u[k], over[k - 1], over[k]
    return float(below + (above - below) * ((1 - low) / (high - low)).clamp(0, 1))
