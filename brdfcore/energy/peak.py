"""Where a scanned albedo is largest, and where it exceeds 1.

Around the best points of the scan the albedo is interpolated by polynomials through Chebyshev-Lobatto nodes, first over
the neighbouring steps, then, where the polynomials' last coefficients say that these were too wide, over a part of
them. On the axes x and y, where the sample's symmetry makes the albedo level, the azimuth stays as it is.
"""

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import max_pool2d

from .scan import Scan, theta_of

NODES, DENSE = 11, 129  # of a patch along each coordinate, and the points at which its polynomial is looked at
SHRINK, ROUNDS = 8.0, 3
PATCHES = 6  # at a time; as often as ROUNDS, before what is left of doubt counts as error
SAFETY = 4.0  # of what a polynomial's last coefficients say that it lacks
SPARE = 2.0  # how much higher than a parabola through its neighbours a top between the scan's points may be


class Peak(NamedTuple):
    """A largest albedo [1], its claimed error, and where it is."""

    albedo: float
    error: float
    u: float
    s: float
    channel: int


class _Patch(NamedTuple):
    """A rectangle of u and s, given by its middle and half its sides; a half of 0 holds the coordinate."""

    u: float
    s: float
    half_u: float
    half_s: float


class _Grid(NamedTuple):
    """Nodes on [-1, 1] and what they are interpolated at, and the matrices from values to those there and to modes."""

    nodes: Tensor
    dense: Tensor
    values: Tensor
    modes: Tensor


@functools.cache
def _grid(*, held: bool) -> _Grid:
    if held:
        one = torch.ones(1, 1, dtype=torch.float64)
        return _Grid(one[0] * 0, one[0] * 0, one, one)
    nodes = np.cos(math.pi * np.arange(NODES)[::-1] / (NODES - 1))
    dense = np.linspace(-1, 1, DENSE)
    terms = np.polynomial.chebyshev.chebvander
    modes = np.linalg.inv(terms(nodes, NODES - 1))
    return _Grid(*(torch.tensor(x) for x in (nodes, dense, terms(dense, NODES - 1) @ modes, modes)))


def largest_index(table: Tensor) -> tuple[int, ...]:
    """The indices of the largest entry; the first of several."""
    return tuple(int(i) for i in np.unravel_index(int(table.argmax()), table.shape))


def highest(scan: Scan, total: Tensor) -> Peak:
    """The largest albedo of a scan (U, S, C) itself; what may be between its points is not claimed."""
    row, column, channel = largest_index(total)
    return Peak(float(total[row, column, channel]), math.inf, float(scan.u[row]), float(scan.s[column]), channel)


def refined(scan: Scan, total: Tensor, claimed: Tensor, tolerance: float) -> tuple[Peak, Peak]:
    """The largest albedo near the best points of a scan (U, S, C), all finite, and the largest of its last row.

    claimed: the errors of the scan. No point of it that may be as high as the best is left unsettled. Of places that
    are as high, the one nearest to the normal is taken. The last row stands for the limit towards grazing, and what the
    row before it, at 100 times the cosine, differs by is part of its error.
    """
    over, doubt = total.amax(-1), claimed.amax(-1)
    exact, covered = (torch.zeros_like(over, dtype=torch.bool) for _ in range(2))
    end = _patch(scan, len(scan.u) - 1, largest_index(_levelled(over[-1:], doubt[-1:]))[1])
    ends = [_inside(end._replace(u=u, half_u=0.0), scan) for u in scan.u[-2:].tolist()]
    patches = [_patch(scan, *largest_index(_levelled(over, doubt)))]
    *peaks, low, last = _solved(scan, [*patches, *ends], tolerance)
    last = last._replace(error=last.error + abs(last.albedo - low.albedo))
    for _ in range(ROUNDS):
        for patch in patches:
            covered |= _covers(patch, scan)
        highest = max(peak.albedo for peak in (*peaks, last))
        unsure = (over + doubt + SPARE * _rises(over) > highest) & ~exact
        u, s = (x[unsure] for x in torch.meshgrid(scan.u, scan.s, indexing="ij"))
        if len(u):
            parts, errors = scan.albedos(u, s, tolerance / 4)
            over[unsure], doubt[unsure] = parts.sum(0).amax(-1), errors.sum(0).amax(-1)
            exact |= unsure
        reach = torch.where(covered, -math.inf, over + SPARE * _rises(over))
        patches = _promising(scan, reach, highest + tolerance / 4)
        if not patches:
            break
        peaks += _solved(scan, patches, tolerance)
    best = max(peaks, key=lambda peak: peak.albedo)
    left = float(reach.max()) - max(best.albedo, last.albedo)
    best = best._replace(error=best.error + (left if left > tolerance / 4 else 0.0))
    level = (over >= best.albedo - tolerance / 4) & (doubt < tolerance) & (scan.u < best.u).unsqueeze(-1)
    if bool(level.any()):
        row, column = largest_index(level.to(torch.int8))
        best = best._replace(u=float(scan.u[row]), s=float(scan.s[column]))
    return best, last


def _promising(scan: Scan, reach: Tensor, floor: float) -> list[_Patch]:
    """Patches about the points of a scan (U, S) that may reach above a floor, the highest first, none in another's."""
    patches: list[_Patch] = []
    reach = reach.clone()
    while len(patches) < PATCHES and float(reach.max()) > floor:
        patches.append(_patch(scan, *largest_index(reach)))
        reach[_covers(patches[-1], scan)] = -math.inf
    return patches


def _covers(patch: _Patch, scan: Scan) -> Tensor:
    """The points of a scan (U, S) that lie in a patch."""
    near_u, near_s = (
        (x - middle).abs() <= half * 1.001 + 1e-9
        for x, middle, half in ((scan.u, patch.u, patch.half_u), (scan.s, patch.s, patch.half_s))
    )
    return near_u.unsqueeze(-1) & near_s


def _levelled(over: Tensor, doubt: Tensor) -> Tensor:
    """Albedos (U, S), those on the axes raised by their errors: what may be as high on an axis counts as there."""
    return torch.cat([over[:, :1] + doubt[:, :1], over[:, 1:-1], over[:, 1:][:, -1:] + doubt[:, 1:][:, -1:]], dim=1)


def _rises(over: Tensor) -> Tensor:
    """How much higher than the local tops of a scan (U, S) the parabolas through their neighbours are; 0 elsewhere."""
    tops = over == max_pool2d(over.unsqueeze(0), 3, 1, 1).squeeze(0)
    rises = torch.zeros_like(over)
    for axis in (0, 1):
        if over.shape[axis] > 2:
            count = over.shape[axis] - 2
            low, middle, high = (over.narrow(axis, k, count) for k in range(3))
            bend = (2 * middle - low - high).clamp(min=1e-300)
            rises.narrow(axis, 1, count).add_((high - low) * ((high - low) / bend) / 8)
    return torch.where(tops, rises, 0.0)


def _patch(scan: Scan, row: int, column: int) -> _Patch:
    """The patch about a point of the scan, as wide as the steps next to it."""
    half_u = float(scan.u[1:].diff()[min(row, len(scan.u) - 3)])
    on_axis = column in (0, len(scan.s) - 1) and scan.mirrored
    half_s = 0.0 if on_axis else float(scan.s[1])
    return _inside(_Patch(float(scan.u[row]), float(scan.s[column]), half_u, half_s), scan)


def _inside(patch: _Patch, scan: Scan) -> _Patch:
    """The patch, moved to where the scan is."""
    u = min(max(patch.u, patch.half_u), float(scan.u[-1]) - patch.half_u)
    return patch._replace(u=u, s=min(max(patch.s, patch.half_s), scan.turn - patch.half_s))


def _solved(scan: Scan, patches: Sequence[_Patch], tolerance: float) -> list[Peak]:
    """The largest albedo of each patch."""
    found: dict[int, Peak] = {}
    open_ = dict(enumerate(patches))
    for _ in range(ROUNDS):
        grids = {q: (_grid(held=p.half_u == 0), _grid(held=p.half_s == 0)) for q, p in open_.items()}
        u = [(p.u + p.half_u * grids[q][0].nodes).repeat_interleave(len(grids[q][1].nodes)) for q, p in open_.items()]
        s = [(p.s + p.half_s * grids[q][1].nodes).repeat(len(grids[q][0].nodes)) for q, p in open_.items()]
        parts, errors = scan.albedos(torch.cat(u), torch.cat(s), tolerance / 4)
        sizes = [len(x) for x in u]
        split = zip(open_.items(), parts.sum(0).split(sizes), errors.sum(0).split(sizes), strict=True)
        further = {}
        for (q, patch), values, error in split:
            along, across = grids[q]
            table = values.reshape(len(along.nodes), len(across.nodes), -1)
            found[q], left, smaller = _top(patch, table, float(error.max()), along, across, tolerance)
            if left > tolerance / 4:
                further[q] = _inside(smaller, scan)
        open_ = further
        if not open_:
            break
    return [found[q] for q in range(len(patches))]


def _top(
    patch: _Patch, table: Tensor, error: float, along: _Grid, across: _Grid, tolerance: float
) -> tuple[Peak, float, _Patch]:
    """The largest of the polynomials through a table (U, S, C), what they may lack, and a smaller patch about it."""
    dense = torch.einsum("ui,sj,ijc->usc", along.values, across.values, table)
    modes = torch.einsum("ui,sj,ijc->usc", along.modes, across.modes, table).abs()
    left = sum(float(m[-2:].sum(0).max()) for m in (modes, modes.transpose(0, 1)) if len(m) > 1)
    # of equals the first, whatever the rounding
    rows, slack = dense.amax((1, 2)), min(max(1e-3 * tolerance, error), tolerance / 4)
    i = int((rows >= rows.max() - slack).to(torch.int8).argmax())
    j, c = largest_index(dense[i])
    rises, moves = zip(_vertex(dense[:, j, c], i), _vertex(dense[i, :, c], j), strict=True)
    u, s = float(along.dense[i]) + moves[0], float(across.dense[j]) + moves[1]
    u, s = patch.u + patch.half_u * u, patch.s + patch.half_s * s
    peak = Peak(float(dense[i, j, c]) + sum(rises), error + SAFETY * left, u, s, c)
    return peak, left, _Patch(u, s, patch.half_u / SHRINK, patch.half_s / SHRINK)


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


def exceeding(scan: Scan, total: Tensor, top: Peak, tolerance: float) -> tuple[float, float]:
    """The first and the last polar angle [rad] at which some albedo exceeds 1, for a scan (U, S, C) and its peak.

    Both are pi/2 where that is closer to the horizon than the scan comes.
    """
    index = int((scan.u < top.u).sum())
    u = torch.cat([scan.u[:index], scan.u.new_tensor([top.u]), scan.u[index:]])
    over = torch.cat([total[:index], total.new_full((1, *total.shape[1:]), top.albedo), total[index:]])
    hot = torch.nonzero((over > 1 + tolerance).any(2).any(1))[:, 0]
    if not len(hot):
        return math.pi / 2, math.pi / 2

    def crossing(outside: int, inside: int) -> float:
        low, high = over[outside], over[inside]
        share = torch.where(
            high > 1, (1 - low) / torch.where(high > 1, high - low, 1.0), math.inf
        )  # if it were straight
        column = int(share.amin(1).argmin())
        s = top.s if inside == index else float(scan.s[column])
        return theta_of(_crossing(scan, float(u[outside]), float(u[inside]), s, tolerance))

    first, last = int(hot[0]), int(hot[-1])
    begin = 0.0 if first == 0 else crossing(first - 1, first)
    return begin, math.pi / 2 if last == len(u) - 1 else crossing(last + 1, last)


def _crossing(scan: Scan, outside: float, inside: float, s: float, tolerance: float) -> float:
    """The u between two at which the largest albedo over the channels crosses 1."""
    grid = _grid(held=False)
    u = 0.5 * (outside + inside + (inside - outside) * grid.nodes)
    parts, _ = scan.albedos(u, torch.full_like(u, s), tolerance)
    over = (grid.values @ parts.sum(0)).amax(1)
    k = max(1, int((over > 1).to(torch.int8).argmax()))
    low, high = float(over[k - 1]), float(over[k])
    share = (float(grid.dense[k - 1]) + 1 + (1 - low) / (high - low) * 2 / (DENSE - 1)) / 2 if high > 1 >= low else 1.0
    return outside + (inside - outside) * share
