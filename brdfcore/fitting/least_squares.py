"""Bounded Levenberg-Marquardt on exact derivatives, batched over starts.

Each start solves (J^T J + lambda diag(J^T J)) step = -J^T r over the values that are not held on an end of their box
by the gradient, moves to the projection of x + step onto the box, and keeps it if the loss falls. lambda follows
Nielsen 1999. A start has converged when the Gauss-Newton decrement g^T (J^T J)^-1 g, twice what another full step could
gain, is below 1e-12 of its loss.
"""

from collections.abc import Callable
from typing import NamedTuple

import torch
from torch import Tensor

from .problem import Gram, Problem

DECREMENT = 1e-12  # of the loss: far below what any data can tell apart, above what float64 sums can resolve
_LAMBDA_LIMIT = 1e14  # beyond it a step no longer changes x


class Outcome(NamedTuple):
    """Where S starts ended."""

    x: Tensor  # (S, D)
    loss: Tensor  # (S,)
    converged: Tensor  # (S,) bool
    iterations: int


def solve_free(gram: Gram, held: Tensor, damping: Tensor) -> Tensor:
    """The damped step (S, D), 0 for held values; values that the data do not reach stay where they are."""
    diagonal = gram.matrix.diagonal(dim1=-2, dim2=-1)
    free = ~held & (diagonal > 0)
    scale = torch.where(free, diagonal.clamp(min=1e-300).rsqrt(), 0.0)
    scaled = scale.unsqueeze(-1) * gram.matrix * scale.unsqueeze(-2)
    size = scaled.shape[-1]
    ridge = torch.where(free, damping.unsqueeze(-1) + size * torch.finfo(torch.float64).eps, 1.0)
    step, _ = torch.linalg.solve_ex(scaled + torch.diag_embed(ridge), -(scale * gram.gradient).unsqueeze(-1))
    return torch.mul(scale, step.squeeze(-1))


def decrement(problem: Problem, x: Tensor, gram: Gram) -> Tensor:
    """g^T (J^T J)^-1 g over the values that are not held, (S,), in the loss's unit."""
    held = problem.held(x, gram.gradient)
    step = solve_free(gram, held, torch.zeros(len(x), dtype=torch.float64))
    return -(step * gram.gradient).sum(-1)


def least_squares(
    problem: Problem, x: Tensor, max_iterations: int = 200, on_step: Callable[[int, float], None] | None = None
) -> Outcome:
    """The optimum that each start x (S, D) leads to, after at most so many iterations."""
    x = x.clamp(problem.low, problem.high)
    gram = problem.gram(x)
    floor = 1e-26 * float((problem.data.root_weight * problem.data.c * problem.data.y).square().sum())
    damping = torch.full((len(x),), 1e-3, dtype=torch.float64)
    growth = torch.full_like(damping, 2.0)
    converged = torch.zeros(len(x), dtype=torch.bool)
    done = 0
    for done in range(1, max_iterations + 1):
        held = problem.held(x, gram.gradient)
        converged = (decrement(problem, x, gram) <= DECREMENT * gram.loss) | (gram.loss <= floor)
        if bool((converged | (damping > _LAMBDA_LIMIT)).all()):
            break
        trial = (x + solve_free(gram, held, damping)).clamp(problem.low, problem.high)
        step = trial - x
        predicted = -(
            2 * (step * gram.gradient).sum(-1) + (step * (gram.matrix @ step.unsqueeze(-1)).squeeze(-1)).sum(-1)
        )
        loss = problem.loss(trial)
        better = (loss < gram.loss) & loss.isfinite() & ~converged
        ratio = torch.where(better, (gram.loss - loss) / predicted.clamp(min=1e-300), 0.0)
        shrink = torch.clamp(1 - (2 * ratio.clamp(max=2) - 1) ** 3, min=1 / 3)
        damping = torch.where(better, (damping * shrink).clamp(min=1e-15), damping * growth).clamp(max=1e16)
        growth = torch.where(better, 2.0, growth * 2)
        x = torch.where(better.unsqueeze(-1), trial, x)
        if bool(better.any()):
            new = problem.gram(x[better])
            for old, part in zip(gram, new, strict=True):
                old[better] = part
        if on_step is not None:
            on_step(done, float(gram.loss.min()))
    return Outcome(x, gram.loss, converged, done)
