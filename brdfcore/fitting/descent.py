"""What Adam and LBFGS share: a loss of order one in variables of unit curvature, inside the box.

    x = x0 + z / sqrt(diag J^T J / sum (c y)^2),  minimised over z; values held on an end by the gradient stay there

so that one step size serves every material.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from .levenberg_marquardt import DECREMENT, Outcome, decrement, solve_free
from .problem import Gram, Problem

_NEARLY = 1e-8  # of the loss: a gradient method that comes this near has converged (6 digits of the optimum)


@dataclass
class Scaled:
    """One start in scaled variables."""

    problem: Problem
    which: Tensor | None
    x0: Tensor  # (D,)
    scale: Tensor  # (D,)
    unit: float

    @classmethod
    def at(cls, problem: Problem, x: Tensor, which: Tensor | None) -> "Scaled":
        """The scaling that the curvature at x (D,) asks for."""
        gram = problem.gram(x.unsqueeze(0), which)
        diagonal = gram.matrix[0].diagonal()
        unit = float(problem.squares[0 if which is None else int(which)]) or 1.0
        typical = diagonal.max().clamp(min=1e-300)
        return cls(problem, which, x, (unit / diagonal.clamp(min=1e-8 * typical)).sqrt(), unit)

    def x(self, z: Tensor) -> Tensor:
        """The raw values of z, put into the box."""
        return (self.x0 + self.scale * z).clamp(self.problem.low, self.problem.high)

    def z(self, x: Tensor) -> Tensor:
        """The scaled variables of raw values."""
        return (x - self.x0) / self.scale

    def gram(self, z: Tensor) -> Gram:
        """The normal equations at z, in raw values."""
        return self.problem.gram(self.x(z.detach()).unsqueeze(0), self.which)

    def loss_and_gradient(self, z: Tensor) -> tuple[float, Tensor]:
        """The loss over the data's own square, and its gradient in z without the values held on an end."""
        x, gram = self.x(z.detach()), self.gram(z)
        held = self.problem.held(x, gram.gradient[0])
        return float(gram.loss[0]) / self.unit, torch.where(held, 0.0, 2 * gram.gradient[0] * self.scale / self.unit)

    def near(self, z: Tensor) -> bool:
        """Whether the Gauss-Newton decrement shows that little is left to gain."""
        gram = self.gram(z)
        held = self.problem.held(self.x(z.detach()).unsqueeze(0), gram.gradient)
        undamped = solve_free(gram, held, torch.zeros_like(gram.loss))
        return bool(decrement(gram, undamped) <= max(_NEARLY, DECREMENT) * gram.loss)

    def outcome(self, z: Tensor, iterations: int) -> Outcome:
        """Where z ended, with the convergence that the decrement there shows."""
        x = self.x(z.detach()).unsqueeze(0)
        near = torch.tensor([self.near(z)])
        return Outcome(x, self.problem.loss(x, self.which), near, iterations)
