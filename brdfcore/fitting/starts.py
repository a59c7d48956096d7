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
    starts, shares = [given.expand(materials, -1, -1)], [torch.ones(materials, len(given), dtype=torch.float64)]
    solved = points.expand(materials, -1, -1)
    linear = projection.useful and projection.problem is problem
    if projection.useful:
        z, loss = _solved(projection, points, count if linear else len(points))
        least = loss.topk(min(count, len(points)), dim=1, largest=False)
        starts.append(_written(projection, points, z, least.indices))
        shares.append(_shares(least.values))
        if not linear:
            solved = _written(projection, points, z, torch.arange(len(points)).expand(materials, -1))
    if not linear:
        which = torch.arange(materials).repeat_interleave(len(points))
        loss = problem.loss(solved.reshape(-1, problem.size), which).reshape(materials, -1)
        least = torch.where(loss.isfinite(), loss, torch.inf).topk(min(count, len(points)), dim=1, largest=False)
        starts.append(solved.gather(1, least.indices.unsqueeze(-1).expand(-1, -1, problem.size)))
        shares.append(_shares(least.values))
    return torch.cat(starts, dim=1), torch.cat(shares, dim=1)


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


def _solved(projection: Projection, points: Tensor, count: int) -> tuple[Tensor, Tensor]:
    """The unknowns (M, S, C, L) at the points and the losses (M, S), as far as the best `count` a material need them.

    Elsewhere they are those of the unknowns without their ends, below which none in the polytope is.
    """
    parts: list[tuple[Tensor, Tensor]] = []
    for x in points.split(_AT_ONCE):
        natural = projection.problem.natural(x)
        affine = projection.affine(x, natural, slopes=False)
        products, offset, a = (
            projection.scan_products(len(x), natural),
            affine.offset.unsqueeze(1),
            affine.a.unsqueeze(1),
        )
        found = projection.solve(products, offset, a, ends=False)
        z, loss = found.z, found.loss
        outside = projection.outside(z)
        enough = torch.where(outside, torch.inf, loss).kthvalue(min(count, len(x)), dim=0).values
        at = (outside & (loss < enough)).nonzero(as_tuple=True)
        if len(at[0]):
            again = projection.solve(products.pick(*at), affine.offset[at[0]], affine.a[at[0]])
            z, loss = z.index_put(at, again.z), loss.index_put(at, again.loss)
        parts.append((z, loss))
    z, loss = (torch.cat(each) for each in zip(*parts, strict=True))
    return z.transpose(0, 1), loss.T


def _written(projection: Projection, points: Tensor, z: Tensor, index: Tensor) -> Tensor:
    """The points (S, D) that an index (M, n) names with their unknowns, of z (M, S, C, L), in them: (M, n, D)."""
    x = points[index].flatten(0, 1)
    own = z.gather(1, index[..., None, None].expand(-1, -1, *z.shape[2:])).flatten(0, 1)
    return projection.write(x, projection.problem.natural(x), own).reshape(*index.shape, -1)
