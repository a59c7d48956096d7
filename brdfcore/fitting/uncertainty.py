"""What the data determine: standard errors and 95 % intervals of a fit's values, from the Jacobian at the optimum.

    cov = H^-1 M H^-1,  H = J^T J,  M = sum over residuals of variance * (dr/dx)(dr/dx)^T

The variance of a residual follows from the sample's sigma where it is known (then 1.96 standard errors make an
interval); else it is estimated for each channel from that channel's residuals, and Student's t makes the interval. A
value stored as its logarithm gets an interval around the logarithm. A value on an end of its box is held there for
the others and has no interval; a combination of values that the data leave free is named, and none of it gets one.
"""

import math
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.func import jvp

from .problem import Problem

NORMAL_QUANTILE = 1.959963984540054  # leaves 2.5 % above it
_PRESSED = 1e-7  # cosine between residuals and a column of J below which nothing presses a value against its end
_RANK = 1e-11  # eigenvalues of the scaled J^T J below this fraction are rounding: J's own digits, squared


@dataclass(frozen=True)
class Uncertainty:
    """Standard errors and intervals by raw position; NaN where there are none."""

    standard_error: Tensor  # (D,), natural unit
    low: Tensor  # (D,)
    high: Tensor  # (D,)
    undetermined: Tensor  # (D,) bool
    held: Tensor  # (D,) bool


def uncertainty(problem: Problem, x: Tensor) -> Uncertainty:
    """The uncertainties of the optimum x (D,)."""
    if problem.size == 0:
        return Uncertainty(x, x, x, x.bool(), x.bool())
    gram = problem.gram(x.unsqueeze(0))
    matrix, meat, freedom = gram.matrix[0], _meat(problem, x), problem.residual_count
    pressed = gram.gradient[0].abs() > _PRESSED * (matrix.diagonal() * gram.loss).sqrt()
    held = problem.held(x.unsqueeze(0), gram.gradient)[0] & pressed
    undetermined = _undetermined(matrix, held)
    free = ~(held | undetermined)
    freedom -= int(free.sum())
    covariance = torch.full_like(matrix, math.nan)
    if bool(free.any()) and (freedom > 0 or problem.data.sigma is not None):
        at = free.nonzero().squeeze(-1)
        part = matrix[at][:, at]
        scale = part.diagonal().rsqrt()
        inverse = torch.linalg.inv(scale.unsqueeze(-1) * part * scale)  # scaled: widths and reflectances differ by 1e4
        inverse = scale.unsqueeze(-1) * inverse * scale
        covariance[at.unsqueeze(-1), at] = inverse @ meat[at][:, at] @ inverse
    error = covariance.diagonal().sqrt()
    factor = t_quantile(freedom) if problem.data.sigma is None else NORMAL_QUANTILE
    return Uncertainty(*_natural(problem, x, error, factor), undetermined, held)


def _meat(problem: Problem, x: Tensor) -> Tensor:
    """Sum over residuals of variance (dr/dx)(dr/dx)^T, (D, D)."""
    channels, names = problem.data.y.shape[1], len(problem.keys)
    by_channel = torch.zeros(channels, names, names, dtype=torch.float64)
    squares = torch.zeros(channels, dtype=torch.float64)
    for data in problem.chunks(channels * (names + 3)):
        residuals, columns = problem.jacobian(x, data)
        if data.sigma is not None:
            f = problem.f(x, data)
            ones = torch.ones_like(f)
            slope = jvp(lambda v, d=data: problem.loss_kind.difference(v, d.y, d.c, problem.scales), (f,), (ones,))[1]
            columns = columns * (data.root_weight * slope.abs() * data.sigma).unsqueeze(-1)
        columns = columns.permute(1, 2, 0)
        by_channel += columns @ columns.transpose(1, 2)
        squares += residuals.square().sum(0)
    if problem.data.sigma is None:
        freedom = problem.data.y.shape[0] - problem.size / channels
        by_channel *= (squares / max(freedom, 1e-300)).reshape(-1, 1, 1)
    return problem.scatter_matrix(by_channel.unsqueeze(0))[0]


def _undetermined(matrix: Tensor, held: Tensor) -> Tensor:
    """Which values take part in a direction along which no residual changes, (D,) bool."""
    diagonal = matrix.diagonal()
    blind = ~held & (diagonal <= 0)
    at = (~held & (diagonal > 0)).nonzero().squeeze(-1)
    if at.numel():
        scale = diagonal[at].rsqrt()
        eigenvalues, vectors = torch.linalg.eigh(scale.unsqueeze(-1) * matrix[at][:, at] * scale)
        free_directions = vectors[:, eigenvalues < _RANK * eigenvalues[-1]]
        blind[at] |= (free_directions.abs() > 0.1).any(-1)
    return blind


def _natural(problem: Problem, x: Tensor, error: Tensor, factor: float) -> tuple[Tensor, Tensor, Tensor]:
    """Standard errors and interval ends in the parameters' own units, the ends clipped to the box."""
    standard_error, low, high = error.clone(), x - factor * error, x + factor * error
    for key, at in problem.slices.items():
        parameter = problem.plan.form.parameters[key]
        ends = parameter.ends(torch.float64)
        if parameter.scale == "log":
            standard_error[at] = error[at] * torch.exp(x[at])
            low[at], high[at] = torch.exp(low[at]), torch.exp(high[at])
        low[at], high[at] = low[at].clamp(*ends), high[at].clamp(*ends)
    return standard_error, low, high


def t_quantile(freedom: int) -> float:
    """Student's t that leaves 2.5 % above it, for so many degrees of freedom; relative error below 1e-9.

    From 1000 degrees on by its expansion about the normal quantile (Abramowitz and Stegun 26.7.5), below by bisection
    of the distribution function, whose integral over theta = atan(t / sqrt(freedom)) is smooth.
    """
    if freedom <= 0:
        return math.nan
    if freedom >= 1000:
        z = NORMAL_QUANTILE
        expansion = (
            (z**3 + z) / 4,
            (5 * z**5 + 16 * z**3 + 3 * z) / 96,
            (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384,
        )
        return z + math.fsum(term / freedom**k for k, term in enumerate(expansion, start=1))
    nodes = torch.linspace(0, 1, 2001, dtype=torch.float64)
    simpson = torch.ones_like(nodes)
    simpson[1:-1:2], simpson[2:-1:2] = 4, 2
    log_norm = math.lgamma((freedom + 1) / 2) - math.lgamma(freedom / 2) - 0.5 * math.log(math.pi)

    def above_zero(t: float) -> float:
        end = math.atan(t / math.sqrt(freedom))
        integrand = torch.exp(log_norm + (freedom - 1) * torch.log(torch.cos(end * nodes)))
        return float((simpson * integrand).sum()) * end / 6000

    low, high = 1.9, 13.0  # the quantiles of an infinite and of one degree of freedom lie between
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if above_zero(middle) < 0.475 else (low, middle)
    return 0.5 * (low + high)
