"""LBFGS with strong Wolfe line search on the scaled problem, restarted whenever a value meets an end of its box."""

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
    """The point that one start x (1, D) leads to; `which` (1,) names its material."""
    scaled = Scaled.at(problem, x[0], which)
    z = torch.nn.Parameter(torch.zeros_like(x[0]))

    def closure() -> Tensor:
        loss, z.grad = scaled.loss_and_gradient(z)
        return torch.tensor(loss, dtype=torch.float64)

    best = float(closure())
    if on_step is not None:
        on_step(0, best * scaled.unit)
    done = 0
    stale = 0
    while done < max_iterations and stale < 2:
        optimizer = torch.optim.LBFGS(
            [z], max_iter=_ROUND, history_size=20, tolerance_grad=0, tolerance_change=0, line_search_fn="strong_wolfe"
        )
        optimizer.step(closure)
        done += _ROUND
        with torch.no_grad():
            z.copy_(scaled.z(scaled.x(z)))
        loss = float(closure())
        stale = stale + 1 if best - loss <= _GAIN * best else 0
        best = min(best, loss)
        if on_step is not None:
            on_step(done, best * scaled.unit)
    return scaled.outcome(z, done)
