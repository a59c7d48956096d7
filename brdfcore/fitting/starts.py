"""Starts from a coarse scan of the shapes, the reflectances solved for at each.

A Sobol set covers the search ranges of everything but the reflectances that scale a term. At each point f is affine
in those, f = offset + sum of column * reflectance, and a few sweeps of coordinate descent in their box solve the small
least-squares problem of each channel. The points with the lowest loss become starts: the cosine loss, and the fit's own
where that is another.
"""

import torch
from torch import Tensor
from torch.func import vmap

from .losses import LOSSES
from .problem import Problem

SCAN_POINTS = 256
_SWEEPS = 60  # of coordinate descent; only a start's accuracy hangs on it


def _scaling_keys(problem: Problem) -> list[str]:
    """The free reflectances in which f is affine: a term's scale, read by other terms only as total minus it."""
    form = problem.plan.form
    scales = {f"{term.label}.{term.model.scale}" for term in form.terms}
    return [
        key
        for key in problem.keys
        if key in scales
        and all(tie.total is not None and tied in scales for tied, tie in form.ties.items() if tie.owner == key)
    ]


def scan(problem: Problem, count: int, seed: int) -> Tensor:
    """Raw vectors (S, D) to start from: the text's own, then up to twice `count` of a seeded scan's best."""
    own = problem.pack(problem.plan.start)
    linear = _scaling_keys(problem)
    shapes = [key for key in problem.keys if key not in linear]
    points = _points(problem, own, shapes, seed)
    if linear:
        points, cosine = _solve_reflectances(problem, points, linear)
        chosen = torch.argsort(cosine)[:count]
    else:
        chosen = torch.zeros(0, dtype=torch.long)
    if not linear or problem.loss_kind.difference is not LOSSES["cosine"].difference:
        chosen = torch.cat([chosen, torch.argsort(problem.loss(points))[:count]]).unique()
    return torch.cat([own.unsqueeze(0), points[chosen]])


def _points(problem: Problem, own: Tensor, shapes: list[str], seed: int) -> Tensor:
    """Sobol points (S, D) over the shapes' search ranges, one value for all channels; elsewhere the text's start."""
    points = own.repeat(SCAN_POINTS if shapes else 1, 1)
    if shapes:
        unit = torch.quasirandom.SobolEngine(len(shapes), scramble=True, seed=seed).draw(
            SCAN_POINTS, dtype=torch.float64
        )
        for column, key in enumerate(shapes):
            parameter = problem.plan.form.parameters[key]
            low, high = parameter.to_raw(torch.tensor(parameter.search_range, dtype=torch.float64))
            points[:, problem.slices[key]] = (low + (high - low) * unit[:, column]).unsqueeze(-1)
    return points.clamp(problem.low, problem.high)


def _solve_reflectances(problem: Problem, points: Tensor, linear: list[str]) -> tuple[Tensor, Tensor]:
    """The points with their reflectances replaced by the least-squares ones, and their cosine losses (S,)."""
    data = problem.data
    weight = data.root_weight * data.c  # the cosine loss, whatever the fit's own
    at = torch.cat([torch.arange(problem.size)[problem.slices[key]] for key in linear])

    def columns(x: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        zero = x.index_fill(0, at, 0.0)
        offset = problem.f(zero, data)
        each = [
            problem.f(zero.index_fill(0, torch.arange(problem.size)[problem.slices[key]], 1.0), data) for key in linear
        ]
        design = weight.unsqueeze(-1) * torch.stack([f - offset for f in each], dim=-1)  # (N, C, L)
        wanted = weight * (data.y - offset)
        by_channel = design.permute(1, 2, 0)
        gram = by_channel @ by_channel.transpose(1, 2)
        return gram, (by_channel @ wanted.T.unsqueeze(-1)).squeeze(-1), wanted.square().sum()

    gram, right, unexplained = vmap(columns, chunk_size=max(1, 2_000_000 // data.y.numel()))(
        points
    )  # (S, C, L, L), (S, C, L)
    channels = data.y.shape[1]
    low, high = (
        torch.stack([bound[problem.slices[key]].expand(channels) for key in linear], dim=-1)
        for bound in (problem.low, problem.high)
    )
    solution = torch.zeros_like(right)
    diagonal = gram.diagonal(dim1=-2, dim2=-1).clamp(min=1e-300)
    for _ in range(_SWEEPS):
        for i in range(len(linear)):
            slope = right[..., i] - (gram[..., i, :] * solution).sum(-1)
            solution[..., i] = (solution[..., i] + slope / diagonal[..., i]).clamp(low[:, i], high[:, i])
    points = points.clone()
    for i, key in enumerate(linear):
        value = solution[..., i]
        one = problem.plan.start[key].ndim == 0
        points[:, problem.slices[key]] = value.mean(-1, keepdim=True) if one else value
    explained = (2 * right - (gram @ solution.unsqueeze(-1)).squeeze(-1)) * solution
    return points, unexplained - explained.sum((1, 2))
