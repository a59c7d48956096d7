"""Adam (Kingma and Ba 2015) on the scaled problem: the step falls along a cosine, and each round is twice as long.

All starts run side by side. One that comes near its optimum ends there; the others begin the next round, scaled by the
curvature where they are: easy problems stop after a hundred steps, and hard ones get the long, slow fall that they
need, so that no step size or count needs choosing.
"""

import math

import torch
from torch import Tensor

from .descent import Scaled
from .levenberg_marquardt import OnStep, Outcome
from .problem import Problem

_STEP = 0.05  # of a variable of unit curvature; from a scanned start a few such steps reach the optimum
_ROUND = 125  # steps of the first round
_LOOK = 25  # steps between two looks at who has arrived, and at how far all have come
_FIRST, _SECOND = 0.9, 0.999  # what the running means of the gradient and of its square keep, the paper's
_LEAST = 1e-12  # added to the root of the latter


def adam(
    problem: Problem,
    x: Tensor,
    which: Tensor | None = None,
    max_iterations: int = 4000,
    on_step: OnStep | None = None,
) -> Outcome:
    """The point that each start x (S, D) leads to; `which` (S,) names its material."""
    x = x.clamp(problem.low, problem.high).clone()
    arrived = torch.zeros(len(x), dtype=torch.bool)
    done, steps = 0, _ROUND
    while done < max_iterations and not bool(arrived.all()):
        going = (~arrived).nonzero()[:, 0]
        scaled = Scaled.at(problem, x[going], None if which is None else which[going])
        steps = min(steps, max_iterations - done)
        z = torch.zeros_like(scaled.x0)
        first, second = torch.zeros_like(z), torch.zeros_like(z)
        for step in range(1, steps + 1):
            loss, gradient = scaled.descent(z)
            if step % _LOOK == 1:
                if on_step is not None:
                    on_step(done, float((loss * scaled.unit).min()))
                if bool(scaled.near(z).all()):
                    break
            first = _FIRST * first + (1 - _FIRST) * gradient
            second = _SECOND * second + (1 - _SECOND) * gradient.square()
            mean, square = first / (1 - _FIRST**step), second / (1 - _SECOND**step)
            rate = 0.5 * _STEP * (1 + math.cos(math.pi * (step - 1) / steps))
            z = scaled.inside(z - rate * mean / (square.sqrt() + _LEAST))
            done += 1
        x[going] = scaled.x(z)
        arrived[going] = scaled.near(z)
        steps *= 2
    return Outcome(x, problem.loss(x, which), arrived, done)
