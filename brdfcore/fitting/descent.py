"""What Adam and LBFGS share: a loss of order one in variables of unit curvature, inside the box.

    x = x0 + z / sqrt(diag J^T J / sum (c y)^2),  minimised over z; values held on an end by the gradient stay there

so that one step size serves every material.
"""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from .least_squares import DECREMENT, Outcome, decrement
from .problem import Problem

OnStep = Callable[[int, float], None]
_NEARLY = 1e-8  # of the loss: a gradient method that comes this near has converged (6 digits of the optimum)


@dataclass
class Scaled:
    """One start in scaled variables."""

    problem: Problem
    x0: Tensor  # (D,)
    scale: Tensor  # (D,)
    unit: float

    @classmethod
    def at(cls, problem: Problem, x: Tensor) -> "Scaled":
        """The scaling that the curvature at x (D,) asks for."""
        gram = problem.gram(x.unsqueeze(0))
        diagonal = gram.matrix[0].diagonal()
        unit = float((problem.data.root_weight * problem.data.c * problem.data.y).square().sum()) or 1.0
        typical = diagonal.max().clamp(min=1e-300)
        return cls(problem, x, (unit / diagonal.clamp(min=1e-8 * typical)).sqrt(), unit)

    def x(self, z: Tensor) -> Tensor:
        """The raw values of z, put into the box."""
        return (self.x0 + self.scale * z).clamp(self.problem.low, self.problem.high)

    def z(self, x: Tensor) -> Tensor:
        """The scaled variables of raw values."""
        return (x - self.x0) / self.scale

    def loss_and_gradient(self, z: Tensor) -> tuple[float, Tensor]:
        """The loss over the data's own square, and its gradient in z without the values held on an end."""
        problem = self.problem
        x = self.x(z.detach()).requires_grad_()
        problem.evaluations += 1
        total = 0.0
        gradient = torch.zeros_like(x)
        for data in problem.chunks(6 * problem.data.y.shape[1]):
            loss = problem.residuals(x, data).square().sum()
            gradient += torch.autograd.grad(loss, x)[0]
            total += float(loss.detach())
        held = problem.held(x.detach(), gradient)
        return total / self.unit, torch.where(held, 0.0, gradient * self.scale / self.unit)

    def outcome(self, z: Tensor, iterations: int) -> Outcome:
        """Where z ended, with the convergence that the Gauss-Newton decrement there shows."""
        x = self.x(z.detach()).unsqueeze(0)
        gram = self.problem.gram(x)
        near = decrement(self.problem, x, gram) <= max(_NEARLY, DECREMENT) * gram.loss
        return Outcome(x, gram.loss, near, iterations)
