"""What the data determine: standard errors, 95 % intervals and covariances, from the Jacobian at the optimum.

    covariance of x = (J^T J)^-1 B (J^T J)^-1,    B the noise's sum over the residuals (noise.py)

Where the samples' sigma is known, 1.96 standard errors make an interval. Where it is not, Student's t does, with the
degrees of freedom that the few samples a value hangs on leave. Such intervals hold for noise that grows with the
value, for weights and for samples of weight 0, and are wider than those of a known sigma.

A value stored as its logarithm gets an interval around the logarithm. A value that the data hold on an end of its box
(ends.py) is fixed there for the others and has no interval; one that lies on its end by chance is free for the others,
and its own interval reaches inwards from there. Intervals are cut at the box. No value that takes part in a direction
that the data leave free (identifiability.py) has an interval; in those of the others that direction counts with the
whole range that is searched along it.
"""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from ..errors import SamplesError
from .ends import certain
from .identifiability import LENGTH, RANK, Spectrum, Unseen, is_suspect, magnitudes, ranges, singular_values, unseen
from .noise import is_known, noise
from .problem import Gram, Problem
from .student import NORMAL_QUANTILE, t_quantile

_PRESSED = 1e-7  # cosine between residuals and a column of J below which nothing presses a value against its end
_SILENT = 1e-12  # of the data: a value whose raw unit moves the residuals by less is lost in their rounding


@dataclass(frozen=True)
class Uncertainty:
    """Standard errors and intervals of M materials by raw position; NaN where there are none."""

    standard_error: Tensor  # (M, D), natural unit
    low: Tensor  # (M, D)
    high: Tensor  # (M, D)
    covariance: Tensor  # (M, D, D), natural units
    chain: Tensor  # (M, D), derivatives of the natural values by the raw ones
    undetermined: Tensor  # (M, D) bool
    vague: Tensor  # (M, D) bool, with an interval that is as long as the range that is searched
    held: Tensor  # (M, D) bool, by the data on an end of the box
    by_chance: Tensor  # (M, D) bool, on an end of the box that noise alone may have led to
    freedom: Tensor  # (M,) residuals that weigh anything, less the directions that are determined
    unseen: tuple[Unseen, ...]  # one a material
    singular_values: tuple[tuple[float, ...], ...]  # one a material, of all that is not held


def uncertainty(problem: Problem, x: Tensor, gram: Gram | None = None) -> Uncertainty:
    """The uncertainties of the optima x (M, D), one a material of the problem, whose normal equations may be known.

    Raises SamplesError where the loss of the samples leaves the type.
    """
    which = torch.arange(len(x))
    counted = (problem.data.root_weight.expand_as(problem.data.y) > 0).sum((1, 2))
    if problem.size == 0:
        none, square = x.bool(), x.new_zeros(len(x), 0, 0)
        blank = (Unseen.nothing(0),) * len(x)
        return Uncertainty(x, x, x, square, x, none, none, none, none, counted, blank, ((),) * len(x))
    gram = gram or problem.gram(x, which)
    if not all(bool(part.isfinite().all()) for part in (x, gram.loss, gram.gradient, gram.matrix)):
        size = problem.data.y.abs()
        raise SamplesError(
            "Expected values to be of a size whose squares a double holds under this loss, got magnitudes from "
            f"{float(size.min()):.3g} to {float(size.max()):.3g}. Choose another unit or loss.",
            field="values",
        )
    matrix, diagonal = gram.matrix, gram.matrix.diagonal(dim1=-2, dim2=-1)
    blind = diagonal <= (_SILENT**2 * problem.squares).unsqueeze(-1)
    pressed = gram.gradient.abs() > _PRESSED * (diagonal * gram.loss.unsqueeze(-1)).sqrt()
    pressed &= problem.held(x, gram.gradient)
    spectrum = Spectrum.of(matrix, ~pressed & ~blind)
    sums = noise(problem, x, spectrum.inverse(), which)
    held = certain(gram, pressed, blind, sums.level)
    if bool((pressed & ~held).any()):
        spectrum = Spectrum.of(matrix, ~held & ~blind)
        sums = sums if is_known(problem) else noise(problem, x, spectrum.inverse(), which)
    lengths = ranges(problem)
    loose = held & ~blind & _loose(problem, gram, spectrum, sums.level, lengths)
    suspect = is_suspect(matrix, sums.level, spectrum, lengths) | (loose | (blind & ~held)).any(-1)
    nothing = Unseen.nothing(problem.size)
    found = [nothing] * len(x)
    undetermined = torch.zeros_like(held)
    kept, over_range = (each.expand(len(x), -1, -1).clone() for each in nothing.kept(lengths))
    freedom = counted.clone()
    for row in suspect.nonzero()[:, 0].tolist():
        parts = (blind[row], lengths, magnitudes(problem, x)[row])
        one = unseen(matrix[row], sums.level[row], ~held[row] | loose[row], *parts)
        released = loose[row] & one.taking_part.any(0)
        if bool((loose[row] & ~released).any()):
            one = unseen(matrix[row], sums.level[row], ~held[row] | released, *parts)
        undetermined[row] = one.taking_part.any(0)
        held[row] &= ~(released & undetermined[row])
        found[row] = one
        kept[row], over_range[row] = one.kept(lengths)
        freedom[row] += len(one.directions)
    freedom -= (~held).sum(-1)
    unknown, degrees = sums.unknown, sums.freedom
    if bool(suspect.any()):
        spectrum = Spectrum.of(matrix, ~held & ~blind)
    if bool(suspect.any()) and not is_known(problem):
        again = noise(
            problem, x[suspect], spectrum.inverse()[suspect], which[suspect], (kept @ spectrum.inverse())[suspect]
        )
        unknown[suspect], degrees[suspect] = again.unknown, again.freedom
    covariance = spectrum.covariance(sums.sum, kept) + over_range
    told = ~(held | undetermined) & ((freedom > 0) | is_known(problem)).unsqueeze(-1)
    variance = torch.where(unknown, math.inf, covariance.diagonal(dim1=-2, dim2=-1).clamp(min=0))
    error = torch.where(told, variance.sqrt(), math.nan)
    factor = torch.full_like(error, NORMAL_QUANTILE) if is_known(problem) else t_quantile(degrees)
    vague = 2 * factor * error >= lengths
    chain = _chain(problem, x)
    finite = error.isfinite()
    both = finite.unsqueeze(-1) & finite.unsqueeze(-2)
    covariance = torch.where(both, chain.unsqueeze(-1) * covariance * chain.unsqueeze(-2), math.nan)
    values = singular_values(matrix, ~held, blind)
    ends = _natural(problem, x, error, factor, chain)
    return Uncertainty(
        *ends, covariance, chain, undetermined, vague, held, pressed & told, freedom, tuple(found), values
    )


def _loose(problem: Problem, gram: Gram, spectrum: Spectrum, level: Tensor, lengths: Tensor) -> Tensor:
    """Where moving a value from its end across its range, the others refitted, costs less than noise does, (M, D)."""
    matrix, diagonal = gram.matrix, gram.matrix.diagonal(dim1=-2, dim2=-1)
    explained = (matrix @ spectrum.inverse() @ matrix).diagonal(dim1=-2, dim2=-1)
    stiffness = (diagonal - explained).clamp(min=0)
    cost = 2 * gram.gradient.abs() * lengths + stiffness * lengths.square()
    hidden = cost * diagonal < LENGTH * level.diagonal(dim1=-2, dim2=-1)
    rounding = (stiffness <= RANK * diagonal) & (
        gram.gradient.square() <= 1e-14 * diagonal * problem.squares.unsqueeze(-1)
    )
    return hidden | rounding


def _chain(problem: Problem, x: Tensor) -> Tensor:
    """The derivatives of the natural values by the raw ones, (M, D)."""
    chain = torch.ones_like(x)
    for key, at in problem.slices.items():
        if problem.plan.form.parameters[key].scale == "log":
            chain[:, at] = torch.exp(x[:, at])
    return chain


def _natural(
    problem: Problem, x: Tensor, error: Tensor, factor: Tensor, chain: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """Standard errors and interval ends in the parameters' units, the ends clipped to what the box and ties allow."""
    low = (x - factor * error).clamp(min=problem.low, max=problem.high)
    high = (x + factor * error).clamp(min=problem.low, max=problem.high)
    for key, at in problem.slices.items():
        if problem.plan.form.parameters[key].scale == "log":
            low[:, at], high[:, at] = torch.exp(low[:, at]), torch.exp(high[:, at])
    return error * chain, low, high
