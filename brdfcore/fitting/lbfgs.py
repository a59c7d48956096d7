"""LBFGS with strong Wolfe line search on the scaled problem, restarted now and then, since values meet ends of the box.

A restart scales the problem again, by the curvature where it is.
"""

import torch
from torch import Tensor

from .descent import Scaled
from .levenberg_marquardt import OnStep, Outcome
from .problem import Problem

_ROUND = 40  # iterations between two looks at the box
_GAIN = 1e-13  # of the loss: a round that gains less has ended


def lbfgs(
    problem: Problem,
    x: Tensor,
    which: Tensor | None = None,
    max_iterations: int = 2000,
    on_step: OnStep | None = None,
) -> Outcome:
    """The point that each start x (S, D) leads to, one after the other; `which` (S,) names its material."""
    x = x.clamp(problem.low, problem.high).clone()
    arrived = torch.zeros(len(x), dtype=torch.bool)
    done = 0
    for row in range(len(x)):
        own = None if which is None else which[row : row + 1]
        x[row], arrived[row], taken = _one(problem, x[row], own, max_iterations, done, on_step)
        done += taken
    return Outcome(x, problem.loss(x, which), arrived, done)


def _one(
    problem: Problem, x: Tensor, which: Tensor | None, max_iterations: int, before: int, on_step: OnStep | None
) -> tuple[Tensor, Tensor, int]:
    """The point that one start x (D,) leads to, whether it has arrived, and the iterations."""
    best, done, stale = torch.inf, 0, 0
    while True:
        scaled = Scaled.at(problem, x.unsqueeze(0), which)
        z = torch.nn.Parameter(torch.zeros_like(scaled.x0))

        def closure(scaled: Scaled = scaled, z: torch.nn.Parameter = z) -> Tensor:
            loss, z.grad = scaled.descent(z.detach())
            return loss[0]

        value = float(scaled.descent(z.detach())[0][0])
        if on_step is not None:
            on_step(before + done, value * float(scaled.unit[0]))
        stale = stale + 1 if best - value <= _GAIN * best else 0
        best = min(best, value)
        if done >= max_iterations or stale == 2:
            return x, scaled.near(z.detach())[0], done
        optimizer = torch.optim.LBFGS(
            [z], max_iter=_ROUND, history_size=20, tolerance_grad=0, tolerance_change=0, line_search_fn="strong_wolfe"
        )
        optimizer.step(closure)
        done += _ROUND
        x = scaled.x(z.detach())[0]
