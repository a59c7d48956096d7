"""What the data determine: standard errors and 95 % intervals of a fit's values, from the Jacobian at the optimum.

    var x_j = sum over residuals of a_ij^2 v_i,   a = J (J^T J)^-1

v_i is the variance of residual i. Where the samples' sigma is known it follows from it, and 1.96 standard errors make
an interval. Where it is not, nothing is assumed of the noise but independence: v_i is estimated by r_i^2 / (1 - h_i)^2
with the leverage h_i (MacKinnon and White 1985, HC3), and Student's t makes the interval, with the degrees of freedom
that the few samples a value hangs on leave (Satterthwaite's, as Bell and McCaffrey 2002 use them). Such intervals hold
for noise that grows with the value, for weights and for samples of weight 0, and are wider than those of a known sigma.

A value stored as its logarithm gets an interval around the logarithm. A value on an end of its box is held there for
the others and has no interval; a combination of values that the data leave free is named, and none of it gets one.
"""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from .problem import Problem

NORMAL_QUANTILE = 1.959963984540054  # leaves 2.5 % above it
_PRESSED = 1e-7  # cosine between residuals and a column of J below which nothing presses a value against its end
_RANK = 1e-11  # eigenvalues of the scaled J^T J below this fraction are rounding: J's own digits, squared
_SILENT = 1e-12  # of the data: a value whose raw unit moves the residuals by less is lost in their rounding
_ALONE = 1e-9  # a sample with 1 - leverage below this determines a value alone, so its noise cannot be seen


@dataclass(frozen=True)
class Uncertainty:
    """Standard errors and intervals by raw position; NaN where there are none."""

    standard_error: Tensor  # (D,), natural unit
    low: Tensor  # (D,)
    high: Tensor  # (D,)
    undetermined: Tensor  # (D,) bool
    held: Tensor  # (D,) bool
    freedom: int  # residuals that weigh anything, less the values that are free


def uncertainty(problem: Problem, x: Tensor) -> Uncertainty:
    """The uncertainties of the optimum x (D,)."""
    counted = int((problem.data.root_weight.expand_as(problem.data.y) > 0).sum())
    weighed = problem.data.sigma is not None and problem.plan.robust is None
    if problem.size == 0:
        return Uncertainty(x, x, x, x.bool(), x.bool(), counted)
    gram = problem.gram(x.unsqueeze(0))
    matrix = gram.matrix[0]
    pressed = gram.gradient[0].abs() > _PRESSED * (matrix.diagonal() * gram.loss).sqrt()
    held = problem.held(x.unsqueeze(0), gram.gradient)[0] & pressed
    undetermined = _undetermined(matrix, held, _SILENT**2 * float(problem.squares()))
    at = (~(held | undetermined)).nonzero().squeeze(-1)
    error, factor = (torch.full_like(x, math.nan) for _ in range(2))
    if at.numel() and (counted > at.numel() or weighed):
        part = matrix[at][:, at]
        scale = part.diagonal().rsqrt()
        inverse = torch.zeros_like(matrix)  # scaled while it is inverted: widths and reflectances differ by 1e4
        scaled = torch.linalg.inv(scale.unsqueeze(-1) * part * scale)
        inverse[at.unsqueeze(-1), at] = scale.unsqueeze(-1) * scaled * scale
        variance, freedom = _variances(problem, x, inverse)
        error[at] = variance[at].sqrt()
        factor[at] = NORMAL_QUANTILE if weighed else t_quantile(freedom[at])
    return Uncertainty(*_natural(problem, x, error, factor), undetermined, held, counted - at.numel())


def _variances(problem: Problem, x: Tensor, inverse: Tensor) -> tuple[Tensor, Tensor]:
    """The variance of each raw value, and the degrees of freedom of its estimate, each (D,)."""
    by_channel = inverse[problem.index]  # (C, P, D)
    own = torch.stack([inverse[index][:, index] for index in problem.index])  # (C, P, P)
    variance, even, even_squared = (torch.zeros(problem.size, dtype=torch.float64) for _ in range(3))
    for data in problem.data.chunks(problem.channels * (1 + len(problem.keys))):
        residuals, columns = problem.jacobian(x, data)  # (C, N), (C, P, N)
        influence = (by_channel.mT @ columns).square()  # (C, D, N)
        if data.sigma is not None and problem.plan.robust is None:
            slope = problem.residuals(problem.f(x.unsqueeze(0), data), data, None)[2]
            spread = (slope * data.sigma)[0].square()
        else:
            left = 1 - (columns * (own @ columns)).sum(1)
            spread = torch.where(left > _ALONE, (residuals / left.clamp(min=_ALONE)).square(), math.inf)
        touched = influence > 1e-24 * inverse.diagonal().unsqueeze(-1)  # an infinite variance concerns whom it reaches
        variance += torch.where(touched, influence * spread.unsqueeze(1), 0.0).sum((0, 2))
        alike = influence * data.root_weight[0].square().unsqueeze(1)  # as if noise were constant
        even += alike.sum((0, 2))
        even_squared += alike.square().sum((0, 2))
    return variance, (even.square() / even_squared.clamp(min=1e-300)).clamp(min=1)


def _undetermined(matrix: Tensor, held: Tensor, silent: float) -> Tensor:
    """Which values take part in a direction along which no residual changes, (D,) bool."""
    diagonal = matrix.diagonal()
    blind = ~held & (diagonal <= silent)
    at = (~held & ~blind).nonzero().squeeze(-1)
    if at.numel():
        scale = diagonal[at].rsqrt()
        eigenvalues, vectors = torch.linalg.eigh(scale.unsqueeze(-1) * matrix[at][:, at] * scale)
        free_directions = vectors[:, eigenvalues < _RANK * eigenvalues[-1]]
        blind[at] |= (free_directions.abs() > 0.1).any(-1)
    return blind


def _natural(problem: Problem, x: Tensor, error: Tensor, factor: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Standard errors and interval ends in the parameters' units, the ends clipped to what the box and ties allow."""
    standard_error = error.clone()
    low = (x - factor * error).clamp(min=problem.low, max=problem.high)
    high = (x + factor * error).clamp(min=problem.low, max=problem.high)
    for key, at in problem.slices.items():
        if problem.plan.form.parameters[key].scale == "log":
            standard_error[at] = error[at] * torch.exp(x[at])
            low[at], high[at] = torch.exp(low[at]), torch.exp(high[at])
    return standard_error, low, high


def t_quantile(freedom: Tensor) -> Tensor:
    """Student's t that leaves 2.5 % above it, for degrees of freedom from 1 up (any shape); relative error below 1e-9.

    From 1000 degrees on by its expansion about the normal quantile (Abramowitz and Stegun 26.7.5), below by bisection
    of the distribution function, whose integral over theta = atan(t / sqrt(freedom)) is smooth.
    """
    z = NORMAL_QUANTILE
    expansion = (
        (z**3 + z) / 4,
        (5 * z**5 + 16 * z**3 + 3 * z) / 96,
        (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384,
    )
    many = z + sum((term / freedom**k for k, term in enumerate(expansion, start=1)), torch.zeros_like(freedom))
    few = freedom.clamp(max=1000)
    nodes = torch.linspace(0, 1, 401, dtype=torch.float64)
    simpson = torch.ones_like(nodes)
    simpson[1:-1:2], simpson[2:-1:2] = 4, 2
    log_norm = torch.lgamma((few + 1) / 2) - torch.lgamma(few / 2) - 0.5 * math.log(math.pi)
    low, high = torch.full_like(few, 1.9), torch.full_like(few, 13.0)  # of infinitely many degrees, and of one
    for _ in range(45):
        middle = 0.5 * (low + high)
        end = torch.atan(middle / few.sqrt())
        cosines = torch.cos(end.unsqueeze(-1) * nodes)
        integrand = torch.exp(log_norm.unsqueeze(-1) + (few.unsqueeze(-1) - 1) * torch.log(cosines))
        below = (simpson * integrand).sum(-1) * end / 1200 < 0.475
        low, high = torch.where(below, middle, low), torch.where(below, high, middle)
    return torch.where(freedom < 1000, 0.5 * (low + high), many)
