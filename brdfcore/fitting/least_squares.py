"""Levenberg-Marquardt on all free values, whatever the loss."""

from torch import Tensor

from .levenberg_marquardt import DECREMENT, OnStep, Outcome, levenberg_marquardt
from .problem import Gram, Problem

_ROUNDING = 1e-26  # of the data's own squares: residuals of the 13th digit


def least_squares(
    problem: Problem,
    x: Tensor,
    which: Tensor | None = None,
    tolerance: float = DECREMENT,
    max_iterations: int = 200,
    on_step: OnStep | None = None,
) -> Outcome:
    """The optimum that each row x (S, D) leads to, after at most so many iterations; `which` names its material."""

    def evaluate(x: Tensor, rows: Tensor) -> tuple[Tensor, Gram]:
        return x, problem.gram(x, None if which is None else which[rows])

    floor = _ROUNDING * problem.squares
    floor = floor.expand(len(x)) if which is None else floor[which]
    return levenberg_marquardt(problem, evaluate, x, floor, tolerance, max_iterations, on_step)
