"""Adam (Kingma and Ba 2015) on the scaled problem: the step falls along a cosine, and each round is twice as long.

A round that ends near the optimum is the last: easy problems stop after a few hundred steps, and hard ones get the
long, slow fall that they need, so that no step size or count needs choosing.
"""

import math

import torch
from torch import Tensor

from .descent import Scaled
from .levenberg_marquardt import OnStep, Outcome
from .problem import Problem

_STEP = 0.05  # of a variable of unit curvature; from a scanned start a few such steps reach the optimum
_ROUND = 250  # steps of the first round


def adam(
    problem: Problem,
    x: Tensor,
    which: Tensor | None = None,
    max_iterations: int = 4000,
    on_step: OnStep | None = None,
) -> Outcome:
    """The point that one start x (1, D) leads to; `which` (1,) names its material."""
    scaled = Scaled.at(problem, x[0], which)
    z = torch.nn.Parameter(scaled.z(scaled.x(torch.zeros_like(x[0]))))
    done, steps = 0, _ROUND
    while done < max_iterations:
        steps = min(steps, max_iterations - done)
        optimizer = torch.optim.Adam([z], lr=_STEP)
        for step in range(steps):
            optimizer.param_groups[0]["lr"] = 0.5 * _STEP * (1 + math.cos(math.pi * step / steps))
            loss, z.grad = scaled.loss_and_gradient(z)
            optimizer.step()
            with torch.no_grad():
                z.copy_(scaled.z(scaled.x(z)))
            if on_step is not None and step % 50 == 0:
                on_step(done + step, loss * scaled.unit)
        done += steps
        if scaled.near(z):
            break
        scaled = Scaled.at(problem, scaled.x(z.detach()), which)  # the curvature here, not at the start
        with torch.no_grad():
            z.zero_()
        steps *= 2
    return scaled.outcome(z, done)
