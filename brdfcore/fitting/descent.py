"""What Adam and LBFGS share: losses of order one in variables of unit curvature, inside the box, a row a start.

    x = x0 + sqrt(sum (c y)^2) S L^-T z,    S J^T J S = L L^T,    S = diag(J^T J)^(-1/2)

so that one step size serves every material, and values that the data show together do not hinder one another. Values
held on an end of the box by the gradient are scaled alone, and stay there.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from .levenberg_marquardt import DECREMENT, decrement, solve_free
from .problem import Problem

_NEARLY = 1e-8  # of the loss: a gradient method that comes this near has converged (6 digits of the optimum)
_FLAT = 1e-8  # of the largest curvature: a value with less is scaled as if it had that much
_RIDGE = 0.1  # of the unit diagonal: valleys are bent, so what the data hardly show is stretched threefold at most
_EXACT = 1e-26  # of the data's own squares: residuals of the 13th digit


@dataclass
class Scaled:
    """Starts in scaled variables z (S, D)."""

    problem: Problem
    which: Tensor | None
    x0: Tensor  # (S, D)
    spread: Tensor  # (S, D, D), dx/dz
    back: Tensor  # (S, D, D), dz/dx
    unit: Tensor  # (S,)

    @classmethod
    def at(cls, problem: Problem, x: Tensor, which: Tensor | None) -> "Scaled":
        """The scaling that the curvature at x (S, D) asks for."""
        gram = problem.gram(x, which)
        held = problem.held(x, gram.gradient)
        squares = problem.squares.expand(len(x)) if which is None else problem.squares[which]
        unit = torch.where(squares > 0, squares, 1.0)
        diagonal = gram.matrix.diagonal(dim1=-2, dim2=-1)
        typical = diagonal.amax(-1, keepdim=True).clamp(min=1e-300)
        scale = diagonal.clamp(min=_FLAT * typical).rsqrt()
        apart = held.unsqueeze(-1) | held.unsqueeze(-2) | torch.eye(x.shape[1], dtype=torch.bool)
        together = (scale.unsqueeze(-1) * gram.matrix * scale.unsqueeze(-2)).masked_fill(apart, 0.0)
        identity = torch.eye(x.shape[1], dtype=torch.float64)
        factor = torch.linalg.cholesky(together + (1 + _RIDGE) * identity).mT
        size = scale * unit.sqrt().unsqueeze(-1)
        inverse = torch.linalg.solve_triangular(factor, identity.expand_as(factor), upper=True)
        return cls(problem, which, x, size.unsqueeze(-1) * inverse, factor / size.unsqueeze(-2), unit)

    def x(self, z: Tensor) -> Tensor:
        """The raw values of z, put into the box."""
        return (self.x0 + times(self.spread, z)).clamp(self.problem.low, self.problem.high)

    def inside(self, z: Tensor) -> Tensor:
        """The scaled variables of the point of the box that z stands for."""
        return times(self.back, self.x(z) - self.x0)

    def descent(self, z: Tensor) -> tuple[Tensor, Tensor]:
        """The losses (S,) over the data's own squares, and their gradients in z without the values held on an end."""
        x = self.x(z)
        loss, gradient = self.problem.gradient(x, self.which)
        slope = torch.where(self.problem.held(x, gradient), 0.0, 2 * gradient / self.unit.unsqueeze(-1))
        return loss / self.unit, times(self.spread.mT, slope)

    def near(self, z: Tensor) -> Tensor:
        """Which rows have arrived, (S,): the Gauss-Newton decrement shows that little is left to gain."""
        x = self.x(z)
        gram = self.problem.gram(x, self.which)
        held = self.problem.held(x, gram.gradient)
        left = decrement(gram, solve_free(gram, held, torch.zeros_like(gram.loss)))
        return left <= max(_NEARLY, DECREMENT) * gram.loss + _EXACT * self.unit


def times(matrix: Tensor, z: Tensor) -> Tensor:
    """The products of matrices (S, D, D) and vectors (S, D)."""
    return (matrix * z.unsqueeze(-2)).sum(-1)
