"""What the residuals say of their own noise: sums over the samples that every standard error is made of.

    var x = (J^T J)^-1 B (J^T J)^-1,    B = sum over residuals of v_i J_i^T J_i

v_i is the variance of residual i. Where the samples' sigma is known it follows from it. Where it is not, nothing is
assumed of the noise but independence: v_i is estimated by r_i^2 / (1 - h_i)^2 with the leverage h_i (MacKinnon and
White 1985, HC3). That is infinite for a sample that determines a value alone, which says nothing of whether the value
is determined, so a second sum takes the channel's mean square residual for samples of leverage above 1/2.
"""

from typing import NamedTuple

import torch
from torch import Tensor

from .problem import Problem

_ALONE = 1e-9  # a sample with 1 - leverage below this determines a value alone, so its noise cannot be seen
_REACHED = 1e-24  # of a value's own sensitivity, squared: below it a sample does not reach the value


class Noise(NamedTuple):
    """Sums over the samples of M materials, by raw position."""

    sum: Tensor  # (M, D, D), B above without what is infinite
    level: Tensor  # (M, D, D), B for the channel's mean noise where a sample has a leverage above 1/2
    unknown: Tensor  # (M, D) bool, values that a sample of infinite variance reaches
    freedom: (
        Tensor  # (M, D), degrees of freedom of each variance (Satterthwaite's, as Bell and McCaffrey 2002 use them)
    )


def is_known(problem: Problem) -> bool:
    """Whether the noise follows from the samples' sigma; a robust form doubts it."""
    return problem.data.sigma is not None and problem.plan.robust is None


def noise(problem: Problem, x: Tensor, inverse: Tensor, which: Tensor, reach: Tensor | None = None) -> Noise:
    """The sums at rows x (M, D) of these materials, with the inverse (M, D, D) of J^T J over the values that are free.

    `reach` (M, D, D) is what turns J^T r into a step of the values, where that is not the inverse itself.
    """
    reach = inverse if reach is None else reach
    by_channel = reach.mT[:, problem.index]  # (M, C, P, D)
    own = torch.stack([inverse[:, index][:, :, index] for index in problem.index], dim=1)  # (M, C, P, P)
    total, low, high = (torch.zeros_like(own) for _ in range(3))
    squares, left_over = (torch.zeros(*own.shape[:2], dtype=own.dtype) for _ in range(2))
    even, even_squared = torch.zeros_like(x), torch.zeros_like(x)
    unknown = torch.zeros_like(x, dtype=torch.bool)
    known = is_known(problem)
    for at, _, piece in problem.data.blocks(len(x), problem.channels):
        data = piece.rows(which[at])
        residuals, columns, slope = problem.jacobian(x[at], data, which[at])  # (M, C, N), (M, C, P, N), (M, C, N)
        if known and data.sigma is not None:
            total[at] += (columns * (slope * data.sigma).square().unsqueeze(2)) @ columns.mT
            continue
        left = 1 - (own[at] @ columns).mul_(columns).sum(2)
        least = float(left.min())
        spread = residuals.div(left if least > _ALONE else left.clamp(min=_ALONE)).square_()
        seen, mild = left > _ALONE, left >= 0.5
        here = (columns * (spread if least > _ALONE else torch.where(seen, spread, 0.0)).unsqueeze(2)) @ columns.mT
        total[at] += here
        if least >= 0.5:
            low[at] += here
        else:
            low[at] += (columns * torch.where(mild, spread, 0.0).unsqueeze(2)) @ columns.mT
            high[at] += (columns * (~mild).to(spread).unsqueeze(2)) @ columns.mT
        squares[at] += residuals.square().sum(-1)
        weight = data.root_weight.square().expand_as(residuals)  # as if noise were constant
        left_over[at] += torch.where(weight > 0, left, 0.0).sum(-1)
        influence = (by_channel[at].mT @ columns).square_()  # (M, C, D, N)
        if least <= _ALONE:
            touched = influence > _REACHED * reach[at].diagonal(dim1=-2, dim2=-1)[:, None, :, None].abs()
            unknown[at] |= (touched & ~seen.unsqueeze(2)).any(-1).any(1)
        influence.mul_(weight.unsqueeze(2))
        even[at] += influence.sum((1, 3))
        even_squared[at] += torch.linalg.vector_norm(influence, dim=(1, 3)).square()
    total = problem.scatter_matrix(total)
    if known:
        return Noise(total, total, unknown, torch.ones_like(x))
    mean = torch.where(left_over > 1e-6, squares / left_over.clamp(min=1e-6), 0.0)  # of no residual more than values
    level = problem.scatter_matrix(low + high * mean[..., None, None])
    return Noise(total, level, unknown, (even.square() / even_squared.clamp(min=1e-300)).clamp(min=1))
