"""The information criterion by which two materials fitted to the same samples are compared.

    criterion = sum r_i^2 / s^2 + p ln n,    p = sum h_i v_i / s^2,    s^2 = sum v_i / n

r_i are the n residuals of the loss, h_i their leverages, v_i their variances, which follow from the residuals of the
richer of the two materials (signal_noise.py) and serve both. Where the noise is even p is the number of free values,
and this is Schwarz's criterion (1978) with the noise estimated. Where it is not, as under relative noise, when a few
samples near the mirror direction carry all of it, p counts what the noise of the samples that decide a value can
feign (Takeuchi 1976), as if there were more values, or fewer samples.

A v_i is the likeliest noise as a function of the signal, but at most three times the mean of e_i^2 = r_i^2 / (1 - h_i)
over the m residuals next in signal, those of 20 directions. So misfit in one place is never taken for noise in another,
and whatever the residuals are, noise or misfit, the criterion falls where the squares fall by more than

    3 p' ln n / m sum e_i^2,    p' = sum max(0, h_i - h_i of the leaner)

about 1 / channels of what is left for every value that is added.
"""

import math
from typing import NamedTuple

import torch
from torch import Tensor

from .problem import Problem
from .signal_noise import variances

NEAR = 20  # directions whose residuals, next in signal, say what the noise of one is at most
_RANK = 1e-11  # eigenvalues of the scaled J^T J below this fraction are rounding, as in uncertainty.py
_LEAST = 1e-3  # of 1 - h: a sample that decides a value alone tells little of its own noise
_NO_MATTER = 1e-12  # of the data's squares: residuals of the sixth digit call for no effect, whatever their shape


class Spread(NamedTuple):
    """The squares of residuals, their leverages and signals at an optimum, each (C N,).

    `unit` is the data's mean square, `values` the number of free values.
    """

    squares: Tensor
    leverage: Tensor
    signal: Tensor
    unit: float
    values: int
    channels: int


def spread(problem: Problem, x: Tensor) -> Spread:
    """The residuals at the optimum x (1, D) of the problem's only material; those of weight 0 are left out."""
    gram = problem.gram(x)
    free = ~problem.held(x, gram.gradient)[0] & (gram.matrix[0].diagonal() > 0)
    scale = torch.where(free, gram.matrix[0].diagonal().clamp(min=1e-300).rsqrt(), 0.0)
    inverse = _inverse(scale.unsqueeze(1) * gram.matrix[0] * scale) * torch.outer(scale, scale)
    own = torch.stack([inverse[index][:, index] for index in problem.index])  # (C, P, P)
    squares, leverage, signal = [], [], []
    for piece in problem.data.chunks(problem.channels):
        r, columns, slope = problem.jacobian(x, piece)  # (1, C, N), (1, C, P, N)
        counted = (piece.root_weight > 0).expand_as(r)
        squares.append(r[counted].square())
        leverage.append((columns * (own @ columns)).sum(2)[counted])
        signal.append((slope * problem.f(x, piece))[counted])
    unit = float(problem.squares[0]) / max(1, sum(map(len, squares)))
    return Spread(torch.cat(squares), torch.cat(leverage), torch.cat(signal), unit, problem.size, problem.channels)


def gain(richer: Spread, leaner: Spread) -> float:
    """The criterion of the richer material less that of the leaner one [1]; below 0 it asks for the richer.

    Infinite where the richer one has fewer than two residuals a value: what it leaves says nothing of the noise.
    """
    if len(richer.squares) < 2 * richer.values:
        return math.inf
    seen = richer.squares / (1 - richer.leverage).clamp(min=_LEAST)
    v = variances(seen, richer.signal, NEAR * richer.channels)
    v = v.clamp(min=_NO_MATTER * richer.unit or 1e-300)
    fall = richer.squares.sum() - leaner.squares.sum()
    price = math.log(max(2, len(v))) * ((richer.leverage - leaner.leverage) * v).sum()
    return float((fall + price) / v.mean())


def _inverse(matrix: Tensor) -> Tensor:
    """The inverse of a positive matrix over the directions that it knows."""
    values, vectors = torch.linalg.eigh(matrix)
    known = values > _RANK * values.max().clamp(min=1e-300)
    inverse: Tensor = (vectors * torch.where(known, 1 / values.clamp(min=1e-300), 0.0)) @ vectors.T
    return inverse
