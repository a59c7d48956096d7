"""Starts from a coarse scan of the shapes, the reflectances solved for at each.

A Sobol set covers the search ranges of everything but the unknowns that a projection solves for. The points with the
lowest loss become starts: that of the projection, and the fit's own where it is another. Materials that share their
directions share the scan.
"""

import math

import torch
from torch import Tensor

from .problem import Problem
from .projection import Projection

_POINTS = 32  # of a scan for each shape of a lone lobe
_MANY_POINTS = 256  # where there are more, or two lobes, whose optima are many
_AGAIN_POINTS = 64  # of one of several lobes, for each of its shapes, the others' held
_BEYOND = 0.25  # of the points: so many more over the whole box, since a width may lie outside the range of the rest
_AT_ONCE = 64  # points: the products of that many stay small
_ROWS = 256  # the same of points with their own material


def scan(problem: Problem, projection: Projection, count: int, seed: int) -> tuple[Tensor, Tensor]:
    """Raw vectors (M, S, D) to start from: the user's, then up to twice `count` of a seeded scan's best.

    With each comes its loss over that of the best of its kind, (M, S), which for the user's counts as 1.
    """
    materials = problem.materials
    own = [problem.pack(values) for values in problem.plan.starts]
    given = torch.stack(own) if own else torch.zeros(0, problem.size, dtype=torch.float64)
    points = _points(problem, projection, seed)
    solved = points.expand(materials, -1, -1)
    best: list[Tensor] = []
    shares = [torch.ones(materials, len(given), dtype=torch.float64)]
    if projection.useful:
        solved, loss = _solved(projection, points)
        best.append(loss.argsort(dim=1)[:, :count])
        shares.append(_shares(loss.gather(1, best[-1])))
    if not projection.useful or projection.problem is not problem:
        which = torch.arange(materials).repeat_interleave(solved.shape[1])
        loss = problem.loss(solved.reshape(-1, problem.size), which).reshape(materials, -1)
        best.append(torch.where(loss.isfinite(), loss, torch.inf).argsort(dim=1)[:, :count])
        shares.append(_shares(loss.gather(1, best[-1])))
    index = torch.cat(best, dim=1).unsqueeze(-1).expand(-1, -1, problem.size)
    starts = torch.cat([given.expand(materials, -1, -1), solved.gather(1, index)], dim=1)
    return starts, torch.cat(shares, dim=1)


def _shares(loss: Tensor) -> Tensor:
    """Losses (M, S), rising, over the first of each row; 1 where that is no positive number."""
    first = loss[:, :1]
    return torch.where(first > 0, loss / first.clamp(min=1e-300), 1.0).nan_to_num(1.0)


def rescan(projection: Projection, x: Tensor, count: int, seed: int) -> Tensor:
    """Raw vectors (M, S, D) that differ from the rows x (M, D) in the shapes of one lobe: the best `count` of each.

    A scan of all shapes at once is coarse. Where one lobe has found its place another may be left without one, its
    reflectance 0 and thus no slope by its shapes to move them.
    """
    problem, materials = projection.problem, len(x)
    found: list[Tensor] = []
    for positions in lobes(projection).values():
        drawn = _drawn(problem, [problem.keys[p] for p in positions], _AGAIN_POINTS * len(positions), seed)
        points = x.unsqueeze(1).expand(-1, len(drawn), -1).clone()
        for p in positions:
            at = problem.slices[problem.keys[p]]
            points[..., at] = drawn[:, at]
        rows = points.reshape(-1, problem.size)
        which = torch.arange(materials).repeat_interleave(len(drawn))
        solved, loss = zip(*map(projection.solved, rows.split(_ROWS), which.split(_ROWS)), strict=True)
        best = torch.cat(loss).reshape(materials, -1).argsort(dim=1)[:, :count]
        index = best.unsqueeze(-1).expand(-1, -1, problem.size)
        found.append(torch.cat(solved).reshape(points.shape).gather(1, index))
    return torch.cat(found, dim=1)


def lobes(projection: Projection) -> dict[str, list[int]]:
    """The positions of the shapes by the term that they belong to."""
    found: dict[str, list[int]] = {}
    for p in projection.shapes:
        found.setdefault(projection.problem.keys[p].split(".")[0], []).append(p)
    return found


def several_lobes(projection: Projection) -> bool:
    """Whether the shapes belong to more than one term."""
    return len(lobes(projection)) > 1


def _points(problem: Problem, projection: Projection, seed: int) -> Tensor:
    """Sobol points (S, D) over the shapes' search ranges, one value for all channels; elsewhere the text's start."""
    own = problem.pack(problem.plan.start).unsqueeze(0)
    shapes = [problem.keys[p] for p in projection.shapes]
    if not shapes:
        return own
    count = _MANY_POINTS if several_lobes(projection) else min(_POINTS * len(shapes), _MANY_POINTS)
    return torch.cat([_drawn(problem, shapes, count, seed), own])  # the text's own shapes are the last point


def _drawn(problem: Problem, shapes: list[str], count: int, seed: int) -> Tensor:
    """Rows of raw values (S, D): these shapes are drawn from their search ranges, and a few from the whole box."""
    more = math.ceil(_BEYOND * count)
    points = problem.pack(problem.plan.start).repeat(count + more, 1)
    unit = torch.quasirandom.SobolEngine(len(shapes), scramble=True, seed=seed).draw(count + more, dtype=torch.float64)
    for column, key in enumerate(shapes):
        parameter, at = problem.plan.form.parameters[key], problem.slices[key]
        low, high = parameter.to_raw(torch.tensor(problem.plan.search_range(key), dtype=torch.float64))
        points[:count, at] = (low + (high - low) * unit[:count, column]).unsqueeze(-1)
        least, most = problem.low[at], problem.high[at]
        points[count:, at] = least + (most - least) * unit[count:, column].unsqueeze(-1)
    return points.clamp(problem.low, problem.high)


def _solved(projection: Projection, points: Tensor) -> tuple[Tensor, Tensor]:
    """The points with their unknowns solved for, (M, S, D), and the projection's losses (M, S)."""
    rows: list[Tensor] = []
    losses: list[Tensor] = []
    for x in points.split(_AT_ONCE):
        natural = projection.problem.natural(x)
        affine = projection.affine(x, natural, slopes=False)
        products = projection.scan_products(len(x), natural)
        found = projection.solve(products, affine.offset.unsqueeze(1), affine.a.unsqueeze(1))
        materials = found.loss.shape[1]
        each = x.repeat_interleave(materials, 0)
        written = projection.write(each, projection.problem.natural(each), found.z.flatten(0, 1))
        rows.append(written.reshape(len(x), materials, -1))
        losses.append(found.loss)
    return torch.cat(rows).transpose(0, 1), torch.cat(losses).T
