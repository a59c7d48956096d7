"""Adam (Kingma and Ba 2015) on the scaled problem, with a step size that falls along a cosine."""

import math

import torch
from torch import Tensor

from .descent import OnStep, Scaled
from .least_squares import Outcome
from .problem import Problem

_STEP = 0.05  # of a variable of unit curvature; from a scanned start a few such steps reach the optimum


def adam(problem: Problem, x: Tensor, max_iterations: int = 3000, on_step: OnStep | None = None) -> Outcome:
    """The point that one start x (1, D) leads to."""
    scaled = Scaled.at(problem, x[0])
    z = torch.nn.Parameter(scaled.z(scaled.x(torch.zeros_like(x[0]))))
    optimizer = torch.optim.Adam([z], lr=_STEP)
    for step in range(max_iterations):
        optimizer.param_groups[0]["lr"] = 0.5 * _STEP * (1 + math.cos(math.pi * step / max_iterations))
        loss, z.grad = scaled.loss_and_gradient(z)
        optimizer.step()
        with torch.no_grad():
            z.copy_(scaled.z(scaled.x(z)))
        if on_step is not None and step % 50 == 0:
            on_step(step, loss * scaled.unit)
    return scaled.outcome(z, max_iterations)
