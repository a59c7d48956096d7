"""Levenberg-Marquardt over the shapes alone, the reflectances solved for at each step."""

from torch import Tensor

from .levenberg_marquardt import DECREMENT, OnStep, Outcome, levenberg_marquardt
from .problem import Gram
from .projection import Projection

_ROUNDING = 1e-13  # of the data's own squares: what sums of products, and not of residuals, leave of a loss


def variable_projection(
    projection: Projection,
    x: Tensor,
    which: Tensor | None = None,
    tolerance: float | Tensor = DECREMENT,
    max_iterations: int = 100,
    on_step: OnStep | None = None,
    known: Gram | None = None,
) -> Outcome:
    """The optimum that each row x (S, D) leads to, after at most so many iterations; `which` names its material.

    Its equations, and those `known` where x is such an end, are those of the shapes alone.
    """

    def evaluate(x: Tensor, rows: Tensor) -> tuple[Tensor, Gram]:
        return projection.gram(x, None if which is None else which[rows])

    problem = projection.problem
    floor = _ROUNDING * problem.squares
    floor = floor.expand(len(x)) if which is None else floor[which]
    return levenberg_marquardt(problem, evaluate, x, floor, tolerance, max_iterations, on_step, known)
