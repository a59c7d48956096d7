"""Bounded Levenberg-Marquardt, batched over rows: the loop, whatever computes the normal equations.

Each row solves (J^T J + lambda diag(J^T J)) step = -J^T r over the values that are not held on an end of their box
by the gradient, moves to the projection of x + step onto the box, and keeps it if the loss falls. lambda follows
Nielsen 1999. A row has converged when the Gauss-Newton decrement g^T (J^T J)^-1 g, twice what another full step could
gain, is a small enough part of its loss. A row that has converged, or can move no more, is not computed again.
"""

from collections.abc import Callable
from typing import NamedTuple

import torch
from torch import Tensor

from .problem import Gram, Problem

DECREMENT = 1e-12  # of the loss: far below what any data can tell apart, above what float64 sums can resolve
_LAMBDA_LIMIT = 1e14  # beyond it a step no longer changes x
OnStep = Callable[[int, float], None]
Evaluate = Callable[
    [Tensor, Tensor], tuple[Tensor, Gram]
]  # x, which row each is -> x with what is solved for, equations


class Outcome(NamedTuple):
    """Where S rows ended."""

    x: Tensor  # (S, D)
    loss: Tensor  # (S,)
    converged: Tensor  # (S,) bool
    iterations: int
    gram: Gram | None = None  # the normal equations there, of all values, where they are known

    def pick(self, index: Tensor) -> "Outcome":
        """The rows of an index."""
        gram = None if self.gram is None else self.gram.pick(index)
        return Outcome(self.x[index], self.loss[index], self.converged[index], self.iterations, gram)


def solve_free(gram: Gram, held: Tensor, damping: Tensor) -> Tensor:
    """The steps (..., S, D) for a damping (..., S), 0 for held values and for those that the data do not reach."""
    diagonal = gram.matrix.diagonal(dim1=-2, dim2=-1)
    free = ~held & (diagonal > 0)
    scale = torch.where(free, diagonal.clamp(min=1e-300).rsqrt(), 0.0)
    scaled = scale.unsqueeze(-1) * gram.matrix * scale.unsqueeze(-2)
    size = scaled.shape[-1]
    ridge = torch.where(free, damping.unsqueeze(-1) + size * torch.finfo(torch.float64).eps, 1.0)
    step, _ = torch.linalg.solve_ex(scaled + torch.diag_embed(ridge), -(scale * gram.gradient).unsqueeze(-1))
    return torch.mul(scale, step.squeeze(-1))


def decrement(gram: Gram, undamped: Tensor) -> Tensor:
    """g^T (J^T J)^-1 g over the values that are not held, (S,), in the loss's unit, from their undamped step."""
    return -(undamped * gram.gradient).sum(-1)


def levenberg_marquardt(
    problem: Problem,
    evaluate: Evaluate,
    x: Tensor,
    floor: Tensor,
    tolerance: float | Tensor = DECREMENT,
    max_iterations: int = 200,
    on_step: OnStep | None = None,
    known: Gram | None = None,
) -> Outcome:
    """The optimum that each row x (S, D) leads to; a loss below the floor (S,) is rounding.

    The tolerance is one for all rows, or one a row. `known` are the equations at x, where `evaluate` has been there.
    """
    if known is None:
        x, known = evaluate(x.clamp(problem.low, problem.high), torch.arange(len(x)))
    x, gram = x.clone(), Gram(*(part.clone() for part in known))
    damping = torch.full((len(x),), 1e-3, dtype=torch.float64)
    growth = torch.full_like(damping, 2.0)
    converged = torch.zeros(len(x), dtype=torch.bool)
    active = torch.arange(len(x))
    enough = torch.as_tensor(tolerance, dtype=torch.float64).expand(len(x))
    done = 0
    for done in range(1, max_iterations + 1):
        here, old, eager, least = gram.pick(active), x[active], damping[active], floor[active]
        held = problem.held(old, here.gradient)
        undamped, step = solve_free(here, held, torch.stack([torch.zeros_like(eager), eager]))
        gain = decrement(here, undamped)
        ended = (gain <= enough[active] * here.loss + 0.01 * least) | (here.loss <= least)
        converged[active] = ended
        going = ~ended & (eager <= _LAMBDA_LIMIT)
        if not bool(going.all()):
            active, here, old, eager, step = active[going], here.pick(going), old[going], eager[going], step[going]
            if not active.numel():
                break
        trial = (old + step).clamp(problem.low, problem.high)
        step = trial - old
        predicted = -(
            2 * (step * here.gradient).sum(-1) + (step * (here.matrix @ step.unsqueeze(-1)).squeeze(-1)).sum(-1)
        )
        trial, new = evaluate(trial, active)
        better = (new.loss < here.loss) & new.loss.isfinite()
        ratio = torch.where(better, (here.loss - new.loss) / predicted.clamp(min=1e-300), 0.0)
        shrink = torch.clamp(1 - (2 * ratio.clamp(max=2) - 1) ** 3, min=1 / 3)
        slower = growth[active]
        damping[active] = torch.where(better, (eager * shrink).clamp(min=1e-15), eager * slower).clamp(max=1e16)
        growth[active] = torch.where(better, 2.0, slower * 2)
        moved = active[better]
        x[moved] = trial[better]
        for part, found in zip(gram, new, strict=True):
            part[moved] = found[better]
        if on_step is not None:
            on_step(done, float(gram.loss.min()))
    return Outcome(x, gram.loss, converged, done, gram)
