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

import numpy as np
import torch
from torch import Tensor

from .problem import Gram, Problem

NORMAL_QUANTILE = 1.959963984540054  # leaves 2.5 % above it
_PRESSED = 1e-7  # cosine between residuals and a column of J below which nothing presses a value against its end
_RANK = 1e-11  # eigenvalues of the scaled J^T J below this fraction are rounding: J's own digits, squared
_SILENT = 1e-12  # of the data: a value whose raw unit moves the residuals by less is lost in their rounding
_ALONE = 1e-9  # a sample with 1 - leverage below this determines a value alone, so its noise cannot be seen


@dataclass(frozen=True)
class Uncertainty:
    """Standard errors and intervals of M materials by raw position; NaN where there are none."""

    standard_error: Tensor  # (M, D), natural unit
    low: Tensor  # (M, D)
    high: Tensor  # (M, D)
    undetermined: Tensor  # (M, D) bool
    held: Tensor  # (M, D) bool
    freedom: Tensor  # (M,) residuals that weigh anything, less the values that are free

    def of_material(self, row: int) -> "Uncertainty":
        """That of one material, without the axis M."""
        return Uncertainty(*(getattr(self, name)[row] for name in self.__dataclass_fields__))


def uncertainty(problem: Problem, x: Tensor, gram: Gram | None = None) -> Uncertainty:
    """The uncertainties of the optima x (M, D), one a material of the problem, whose normal equations may be known."""
    which = torch.arange(len(x))
    counted = (problem.data.root_weight.expand_as(problem.data.y) > 0).sum((1, 2))
    known_noise = problem.data.sigma is not None and problem.plan.robust is None
    if problem.size == 0:
        return Uncertainty(x, x, x, x.bool(), x.bool(), counted)
    gram = gram or problem.gram(x, which)
    matrix, diagonal = gram.matrix, gram.matrix.diagonal(dim1=-2, dim2=-1)
    pressed = gram.gradient.abs() > _PRESSED * (diagonal * gram.loss.unsqueeze(-1)).sqrt()
    held = problem.held(x, gram.gradient) & pressed
    undetermined = _undetermined(matrix, held, _SILENT**2 * problem.squares())
    free = ~(held | undetermined)
    freedom = counted - free.sum(-1)
    scaled, scale = _scaled(matrix, free)  # widths and reflectances differ by 1e4
    inverse = torch.linalg.inv(scaled) * _outer(scale)
    variance, alike = _variances(problem, x, which, inverse)
    some = free & ((freedom > 0) | known_noise).unsqueeze(-1)
    error = torch.where(some, variance.sqrt(), math.nan)
    factor = torch.full_like(error, NORMAL_QUANTILE) if known_noise else t_quantile(alike)
    return Uncertainty(*_natural(problem, x, error, factor), undetermined, held, freedom)


def _outer(x: Tensor) -> Tensor:
    return x.unsqueeze(-1) * x.unsqueeze(-2)


def _scaled(matrix: Tensor, free: Tensor) -> tuple[Tensor, Tensor]:
    """The matrix (M, D, D) with a diagonal of 1 and nothing of what is not free, and the scale (M, D) to that."""
    diagonal = matrix.diagonal(dim1=-2, dim2=-1)
    scale = torch.where(free, diagonal.clamp(min=1e-300).rsqrt(), 0.0)
    return matrix * _outer(scale) + torch.diag_embed((~free).to(matrix)), scale


def _variances(problem: Problem, x: Tensor, which: Tensor, inverse: Tensor) -> tuple[Tensor, Tensor]:
    """The variance of each raw value, and the degrees of freedom of its estimate, each (M, D)."""
    by_channel = inverse[:, problem.index]  # (M, C, P, D)
    own = torch.stack([inverse[:, index][:, :, index] for index in problem.index], dim=1)  # (M, C, P, P)
    variance, even, even_squared = (torch.zeros_like(x) for _ in range(3))
    for piece in problem.data.chunks(problem.channels * len(x)):
        data = piece.rows(which)
        residuals, columns, slope = problem.jacobian(x, data, which)  # (M, C, N), (M, C, P, N), (M, C, N)
        influence = (by_channel.mT @ columns).square_()  # (M, C, D, N)
        if data.sigma is not None and problem.plan.robust is None:
            spread = (slope * data.sigma).square()
        else:
            left = 1 - (columns * (own @ columns)).sum(2)
            spread = torch.where(left > _ALONE, (residuals / left.clamp(min=_ALONE)).square(), math.inf)
        if bool(spread.isfinite().all()):
            variance += (influence @ spread.unsqueeze(-1)).sum((1, 3))
        else:  # an infinite variance concerns only whom it reaches
            touched = influence > 1e-24 * inverse.diagonal(dim1=-2, dim2=-1)[:, None, :, None]
            variance += torch.where(touched, influence * spread.unsqueeze(2), 0.0).sum((1, 3))
        if data.sigma is None or problem.plan.robust is not None:
            weight = data.root_weight.square().expand_as(residuals).unsqueeze(-1)  # as if noise were constant
            even += (influence @ weight).sum((1, 3))
            even_squared += (influence.square_() @ weight.square()).sum((1, 3))
    return variance, (even.square() / even_squared.clamp(min=1e-300)).clamp(min=1)


def _undetermined(matrix: Tensor, held: Tensor, silent: Tensor) -> Tensor:
    """Which values take part in a direction along which no residual changes, (M, D) bool."""
    diagonal = matrix.diagonal(dim1=-2, dim2=-1)
    blind = ~held & (diagonal <= silent.unsqueeze(-1))
    seen = ~held & ~blind
    eigenvalues, vectors = torch.linalg.eigh(_scaled(matrix, seen)[0])
    silent_directions = eigenvalues < _RANK * eigenvalues[..., -1:]
    unseen: Tensor = seen & ((vectors.abs() > 0.1) & silent_directions.unsqueeze(-2)).any(-1)
    return blind | unseen


def _natural(problem: Problem, x: Tensor, error: Tensor, factor: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Standard errors and interval ends in the parameters' units, the ends clipped to what the box and ties allow."""
    standard_error = error.clone()
    low = (x - factor * error).clamp(min=problem.low, max=problem.high)
    high = (x + factor * error).clamp(min=problem.low, max=problem.high)
    for key, at in problem.slices.items():
        if problem.plan.form.parameters[key].scale == "log":
            standard_error[:, at] = error[:, at] * torch.exp(x[:, at])
            low[:, at], high[:, at] = torch.exp(low[:, at]), torch.exp(high[:, at])
    return standard_error, low, high


def t_quantile(freedom: Tensor) -> Tensor:
    """Student's t that leaves 2.5 % above it, for degrees of freedom from 1 up (any shape); relative error below 1e-9.

    From 1000 degrees on by its expansion about the normal quantile (Abramowitz and Stegun 26.7.5). Below, by Newton's
    method on the distribution function of theta = atan(t / sqrt(freedom)), whose integrand is smooth and falls, so
    that the steps rise to the quantile from any smaller start.
    """
    z = NORMAL_QUANTILE
    expansion = (
        (z**3 + z) / 4,
        (5 * z**5 + 16 * z**3 + 3 * z) / 96,
        (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384,
    )
    many = z + sum((term / freedom**k for k, term in enumerate(expansion, start=1)), torch.zeros_like(freedom))
    few = freedom.clamp(max=1000)
    gauss = np.polynomial.legendre.leggauss(24)
    nodes, rule = torch.from_numpy(0.5 * (gauss[0] + 1)), torch.from_numpy(0.5 * gauss[1])
    log_norm = torch.lgamma((few + 1) / 2) - torch.lgamma(few / 2) - 0.5 * math.log(math.pi)
    theta = torch.atan(1.9 / few.sqrt())  # below that of infinitely many degrees
    for _ in range(8):
        cosines = torch.cos(theta.unsqueeze(-1) * nodes)
        below = torch.exp(log_norm.unsqueeze(-1) + (few.unsqueeze(-1) - 1) * torch.log(cosines)) @ rule * theta
        theta = theta + (0.475 - below) / torch.exp(log_norm + (few - 1) * torch.log(torch.cos(theta)))
    return torch.where(freedom < 1000, few.sqrt() * torch.tan(theta), many)
