"""Where a scanned albedo is largest, and where it exceeds 1.

A scan is cheap and coarse. What may be the largest of its points is looked at again, and around tops that may rise
above it the albedo is interpolated (patch.py). On the axes x and y, where the sample's symmetry makes the albedo level,
the azimuth stays as it is.
"""

import math

import torch
from torch import Tensor
from torch.nn.functional import max_pool2d

from .patch import ALONE, DEAREST, DENSE, Patch, Peak, grid, largest, largest_index
from .scan import Scan, theta_of

MIDDLE = 1e-4  # tolerance between the scan's and the caller's
SPARE = 2.0  # how much higher than a parabola through its neighbours a top between the scan's points may be


def highest(scan: Scan, total: Tensor) -> Peak:
    """The largest albedo of a scan (U, S, C) itself; what may be between its points is not claimed."""
    row, column, channel = largest_index(total)
    return Peak(float(total[row, column, channel]), math.inf, float(scan.u[row]), float(scan.s[column]), channel)


def refined(scan: Scan, total: Tensor, claimed: Tensor, tolerance: float) -> tuple[Peak, Peak]:
    """The largest albedo near the best points of a scan (U, S, C), all finite, and the largest of its last row.

    claimed: the errors of the scan. Of places that are as high, the one nearest to the normal is taken. The last row
    stands for the limit towards grazing, and what the row before it, at 100 times the cosine, differs by is part of its
    error.
    """
    over, doubt, channels = _settled(scan, total, claimed, tolerance)

    def point(row: int, column: int) -> Peak:
        albedo, error, channel = (table[row, column].item() for table in (over, doubt, channels))
        return Peak(albedo, error, float(scan.u[row]), float(scan.s[column]), int(channel))

    end = _patch(scan, len(scan.u) - 1, _first(over[-1:], tolerance, scan)[1])
    best = point(*_first(over, tolerance, scan))
    reach = over + SPARE * _rises(scan, over)
    # a limit that cannot be the largest comes last: it may take all that may be spent
    last = _limit(scan, end, tolerance) if float(reach[-1].max()) >= best.albedo - tolerance else None
    known = best.albedo if last is None else last.albedo
    # as many patches as it takes: a level albedo has a doubtful edge at each of its azimuths
    while float(reach.max()) > max(best.albedo, known) + tolerance / 2 and scan.evaluations <= DEAREST:
        patch = _patch(scan, *_first(reach, tolerance, scan))
        best = max(best, largest(scan, patch, tolerance), key=lambda peak: peak.albedo)
        reach[patch.covers(scan)] = -math.inf
    left = float(reach.max()) - max(best.albedo, known)
    best = best._replace(error=best.error + max(left, 0.0))
    level = (over >= best.albedo - tolerance / 4) & (doubt < tolerance) & (scan.u < best.u).unsqueeze(-1)
    if bool(level.any()):
        earlier = point(*largest_index(level.to(torch.int8)))
        best = best._replace(u=earlier.u, s=earlier.s, channel=earlier.channel)
    return best, last or _limit(scan, end, tolerance)


def _limit(scan: Scan, end: Patch, tolerance: float) -> Peak:
    """The largest albedo of the last row over a patch of azimuths, in whose error is what the row before it lacks."""
    if end.half_s > 0:
        last = largest(scan, end._replace(u=float(scan.u[-1]), half_u=0.0), tolerance)
        parts, _ = scan.albedos(scan.u[-2:-1], scan.u.new_tensor([last.s]), tolerance / 4)
        low = float(parts.sum(0).max())
    else:  # both rows in one call
        parts, errors = scan.albedos(scan.u[-2:], torch.full_like(scan.u[-2:], end.s), tolerance / 4)
        (before, found), error = parts.sum(0), float(errors.sum(0)[1].max())
        low, last = float(before.max()), Peak(float(found.max()), error, float(scan.u[-1]), end.s, int(found.argmax()))
    return last._replace(error=last.error + abs(last.albedo - low))


def _settled(scan: Scan, total: Tensor, claimed: Tensor, tolerance: float) -> tuple[Tensor, Tensor, Tensor]:
    """The largest of a scan (U, S, C) over its channels, its error, and the channel, (U, S) each.

    To a quarter of the tolerance wherever the albedo may be the largest of all, or of the last row.
    """
    (over, channel), doubt = total.max(-1), claimed.amax(-1)
    for asked in (MIDDLE, tolerance / 4):
        above, below = over + doubt + SPARE * _rises(scan, over), over - doubt
        unsure = above > below.max()
        unsure[-1] = above[-1] > below[-1].max()
        unsure &= doubt > asked
        u, s = (x[unsure] for x in torch.meshgrid(scan.u, scan.s, indexing="ij"))
        if len(u):
            parts, errors = scan.albedos(u, s, asked)
            over[unsure], channel[unsure] = parts.sum(0).max(-1)
            doubt[unsure] = errors.sum(0).amax(-1)
    return over, doubt, channel


def _first(table: Tensor, tolerance: float, scan: Scan) -> tuple[int, int]:
    """Where a table (U, S) is largest; what is as high in an earlier row, or on an axis, counts as there."""
    row = int((table.amax(1) >= table.max() - tolerance / 4).to(torch.int8).argmax())
    line = table[row].clone()
    if scan.mirrored:
        line[[0, -1]] += tolerance / 4
    return row, int(line.argmax())


def _patch(scan: Scan, row: int, column: int) -> Patch:
    """The patch about a point of the scan, as wide as the steps next to it."""
    half_u = float(scan.u.diff()[max(row - 1, 0) : row + 1].max())
    on_axis = column in (0, len(scan.s) - 1) and scan.mirrored
    half_s = 0.0 if on_axis else float(scan.s[1])
    return Patch(float(scan.u[row]), float(scan.s[column]), half_u, half_s).inside(scan)


def _rises(scan: Scan, over: Tensor) -> Tensor:
    """How much higher than the local tops of a scan (U, S) the parabolas through their neighbours are; 0 elsewhere."""
    tops = over == max_pool2d(over.unsqueeze(0), 3, 1, 1).squeeze(0)
    rises = torch.zeros_like(over)
    for axis, at in ((0, scan.u.unsqueeze(1)), (1, scan.s.unsqueeze(0))):
        if over.shape[axis] > 2:
            step, rise = at.diff(dim=axis), over.diff(dim=axis)
            count = over.shape[axis] - 2
            (before, after), (up, down) = (
                [part.narrow(axis, k, count) for k in (0, 1)] for part in (step, rise / step)
            )  # steps are not even in u
            slope = (up * after + down * before) / (before + after)
            bend = ((up - down) / (before + after)).clamp(min=1e-300)
            rises.narrow(axis, 1, count).add_(slope * (slope / bend) / 4)
    return torch.where(tops, rises, 0.0)


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
    fine = grid(ALONE)
    u = 0.5 * (outside + inside + (inside - outside) * fine.nodes)
    parts, _ = scan.albedos(u, torch.full_like(u, s), tolerance)
    over = (fine.values @ parts.sum(0)).amax(1)
    k = max(1, int((over > 1).to(torch.int8).argmax()))
    low, high = float(over[k - 1]), float(over[k])
    share = (float(fine.dense[k - 1]) + 1 + (1 - low) / (high - low) * 2 / (DENSE - 1)) / 2 if high > 1 >= low else 1.0
    return outside + (inside - outside) * share
