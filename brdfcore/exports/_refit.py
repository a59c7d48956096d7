"""The member of a two-parameter family of materials that is nearest to a given material.

A family is linear in its two reflectances, each in [0, 1]: f = offset + sum of coefficient * basis, by channel.
Its two shape parameters are searched for on a logarithmic grid that closes in on the best point, so that no start can
lead astray; for each, the reflectances are solved for. What is minimised is the difference of _difference.py.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from ._difference import Nodes

ROUNDS = 8  # each closes in to the best point's neighbours, by a factor of 3: from 1e4 to 1e-3 of the value
GRID = 7  # values an axis and round
POINTS = 2**14  # directions in the search; fewer would miss the optimum of lobes narrower than 0.1 by some percent

Array = npt.NDArray[np.float64]
Bases = Callable[[Nodes, tuple[float, float]], list[Tensor]]


@dataclass(frozen=True)
class Family:
    """Bases (N,) of the nodes and two shape parameters, the offset and two more; the range of the parameters."""

    bases: Bases
    range: tuple[float, float]


@dataclass(frozen=True)
class Nearest:
    """The nearest member: its shape parameters, and its coefficients (K, C)."""

    shape: tuple[float, float]
    coefficients: Tensor


def nearest(family: Family, at: Nodes, isotropic: bool) -> Nearest:
    """The member of the family with the least difference at the nodes; one shape parameter for both if isotropic."""
    low, high = (math.log(end) for end in family.range)
    centres, half = [0.5 * (low + high)] * (1 if isotropic else 2), 0.5 * (high - low)
    least, found, best = math.inf, np.zeros(0), tuple(centres)
    steps = [2 * k / (GRID - 1) - 1 for k in range(GRID)]
    for _ in range(ROUNDS):
        axes = [[min(max(centre + half * step, low), high) for step in steps] for centre in centres]
        for point in itertools.product(*axes):
            squares, coefficients = solve(family.bases(at, (math.exp(point[0]), math.exp(point[-1]))), at)
            if squares < least:
                least, best, found = squares, point, coefficients
        centres, half = list(best), half * 2 / (GRID - 1)
    return Nearest((math.exp(best[0]), math.exp(best[-1])), torch.from_numpy(found))


def solve(bases: list[Tensor], at: Nodes) -> tuple[float, Array]:
    """The least sum of squares, and the coefficients in [0, 1] (K, C) that give it; the first basis is the offset."""
    root = at.weight.sqrt()[:, None]
    target, columns = root * (at.f - bases[0][:, None]), root * torch.stack(bases[1:], 1)
    gram, moments = (columns.T @ columns).numpy(), (columns.T @ target).numpy()
    own = target.square().sum(0).numpy()
    found = np.zeros_like(moments)
    least = own.copy()
    for channel, held in itertools.product(range(moments.shape[1]), itertools.product((None, 0.0, 1.0), repeat=2)):
        tried = np.array([end or 0.0 for end in held])
        free = [k for k, end in enumerate(held) if end is None]
        if free:
            inner = gram[np.ix_(free, free)]
            if np.linalg.det(inner) <= 1e-14 * inner.diagonal().prod():
                continue  # the bases cannot be told apart, or one is 0: the cases with one held cover it
            tried[free] = np.linalg.solve(inner, moments[free, channel] - gram[free] @ tried)
        squares = own[channel] - 2 * tried @ moments[:, channel] + tried @ gram @ tried
        if tried.min() >= 0 and tried.max() <= 1 and squares < least[channel]:
            least[channel], found[:, channel] = squares, tried
    return float(least.sum()), found
