"""What the data do not determine: directions in the space of a fit's values along which the model hardly changes.

    J^T J = S^-1 (V diag(s^2) V^T) S^-1,    S scales each column of the Jacobian J to unit length

The singular values s are pure numbers; a direction whose s is 0 to rounding changes no residual. Noise hides others: a
direction counts as not determined where, along its 95 % interval, some value would cross all of the range in which it
is searched, a factor of 300 for a width, [0, 1] for a reflectance or alpha, or the user's bounds where those are
narrower. A value takes part in such a direction if, over that length, it changes by half of itself or more (a width by
exp(1/2)) and by more than the length of its interval would be if the others were known. Directions are combined until
each has as few such values as possible.
"""

from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor

from .problem import Problem
from .student import NORMAL_QUANTILE

RANK = 1e-11  # eigenvalues of the scaled J^T J below this fraction are rounding: J's own digits, squared
LENGTH = (2 * NORMAL_QUANTILE) ** 2  # the square of an interval's length over its standard error
_SHARE = 0.5  # of itself that a value changes by where it takes part
_LISTED = 3  # channels of a key that take part and are named one by one
_ROUNDING = 1e-6  # of its range: a smaller part in a direction is rounding


class Spectrum(NamedTuple):
    """The eigenvalues (M, D), rising, and eigenvectors (M, D, D) of J^T J with its columns scaled to unit length."""

    scale: Tensor  # (M, D), 0 for what is not asked about
    values: Tensor
    vectors: Tensor

    @classmethod
    def of(cls, matrix: Tensor, asked: Tensor) -> "Spectrum":
        """The spectrum of J^T J (M, D, D) over the values that are asked about (M, D); the others have 1."""
        diagonal = matrix.diagonal(dim1=-2, dim2=-1)
        scale = torch.where(asked, diagonal.clamp(min=1e-300).rsqrt(), 0.0)
        scaled = matrix * scale.unsqueeze(-1) * scale.unsqueeze(-2) + torch.diag_embed((~asked).to(matrix))
        return cls(scale, *torch.linalg.eigh(scaled))

    @property
    def silent(self) -> Tensor:
        """The directions that change no residual, (M, D) bool."""
        return self.values < RANK * self.values[..., -1:]

    @property
    def turned(self) -> Tensor:
        """The raw values of the directions, (M, D, D)."""
        return self.scale.unsqueeze(-1) * self.vectors

    @property
    def weakness(self) -> Tensor:
        """One over each eigenvalue, 0 where that is rounding."""
        return torch.where(self.silent, 0.0, 1 / torch.where(self.silent, 1.0, self.values))

    def inverse(self) -> Tensor:
        """The inverse of J^T J over what is asked about, its silent directions left out, (M, D, D)."""
        return (self.turned * self.weakness.unsqueeze(-2)) @ self.turned.mT

    def covariance(self, total: Tensor, kept: Tensor) -> Tensor:
        """What `kept` (M, D, D) keeps of the covariance for noise of this sum.

        It is formed along the directions, so that small variances keep their digits beside large ones.
        """
        inner = self.turned.mT @ total @ self.turned
        outer = (kept @ self.turned) * self.weakness.unsqueeze(-2)
        return outer @ inner @ outer.mT


class Unseen(NamedTuple):
    """What the data of one material leave free: k directions."""

    basis: Tensor  # (D, k), orthonormal in raw values counted in search ranges
    directions: Tensor  # (k, D) raw; they span the same, and each takes one value across its search range
    taking_part: Tensor  # (k, D) bool

    @classmethod
    def nothing(cls, size: int) -> "Unseen":
        """No direction of so many values."""
        none = torch.zeros(0, size, dtype=torch.float64)
        return cls(none.T, none, none.bool())

    def kept(self, lengths: Tensor) -> tuple[Tensor, Tensor]:
        """What keeps all but these directions of raw values, and their own covariance, over search ranges; (D, D)."""
        unit = torch.eye(len(lengths), dtype=torch.float64)
        across = self.basis / self.basis.abs().max(0, keepdim=True).values if self.basis.shape[1] else self.basis
        away, over_range = self.basis @ self.basis.T, across @ across.T
        return unit - lengths.unsqueeze(-1) * away / lengths, _outer(lengths) * over_range / LENGTH


def ranges(problem: Problem) -> Tensor:
    """The length of the range in which each raw value is searched, within the user's bounds, (D,)."""
    found = torch.ones(problem.size, dtype=torch.float64)
    for key, at in problem.slices.items():
        parameter = problem.plan.form.parameters[key]
        low, high = parameter.to_raw(torch.tensor(problem.plan.search_range(key), dtype=torch.float64))
        found[at] = high - low
    return found


def magnitudes(problem: Problem, x: Tensor) -> Tensor:
    """What a change of each raw value of x (M, D) by all of itself is: its size, or 1 where it is a logarithm."""
    size = x.abs()
    for key, at in problem.slices.items():
        if problem.plan.form.parameters[key].scale == "log":
            size[:, at] = 1.0
    return size


def is_suspect(matrix: Tensor, level: Tensor, spectrum: Spectrum, lengths: Tensor) -> Tensor:
    """Whether a material's data may leave some direction of the spectrum free, (M,) bool."""
    diagonal, noise = (m.diagonal(dim1=-2, dim2=-1) for m in (matrix, level))
    alone = (spectrum.scale > 0) & (LENGTH * noise >= (lengths * diagonal).square())
    spread = spectrum.covariance(level, torch.eye(len(lengths), dtype=torch.float64)).diagonal(dim1=-2, dim2=-1)
    return (alone | spectrum.silent | (LENGTH * spread >= lengths.square())).any(-1)


def unseen(matrix: Tensor, level: Tensor, asked: Tensor, blind: Tensor, lengths: Tensor, sizes: Tensor) -> Unseen:
    """What one material's data leave free of the values that are asked about (D,), of which the blind move nothing.

    From J^T J and the noise's sum (D, D), the search ranges (D,) and the magnitudes (D,) of the values.
    """
    diagonal = matrix.diagonal()
    alone_error = torch.where(blind, 0.0, level.diagonal().sqrt() / diagonal.clamp(min=1e-300))  # the others known
    alone = asked & (blind | (LENGTH * alone_error.square() >= lengths.square()))
    rest = asked & ~alone
    spectrum = Spectrum.of(matrix.unsqueeze(0), rest.unsqueeze(0))
    unit = torch.eye(len(lengths), dtype=torch.float64)
    spread = spectrum.covariance(level.unsqueeze(0), unit)[0] / _outer(lengths)
    silent = spectrum.turned[0][:, spectrum.silent[0]] / lengths.unsqueeze(-1)
    if silent.shape[1]:
        silent = torch.linalg.qr(silent)[0]
        spread = spread + 10 * (1 + spread.trace()) * silent @ silent.T
    variances, vectors = torch.linalg.eigh(spread)
    weak = vectors[:, LENGTH * variances * vectors.square().max(0).values >= 1]
    directions = _sparse(weak.T)
    if len(directions):
        directions = directions / directions.abs().max(-1, keepdim=True).values * lengths
    change = directions.abs()
    least = torch.maximum(_SHARE * torch.minimum(lengths, sizes), LENGTH**0.5 * alone_error)
    taking_part = rest & (change >= torch.maximum(least, _ROUNDING * lengths))
    none = ~taking_part.any(-1)
    taking_part[none, (change / lengths).argmax(-1)[none]] = True
    own = unit[alone]
    taking_part = torch.cat([own.bool(), taking_part])
    order = taking_part.to(torch.uint8).argmax(-1).argsort(stable=True)  # by the first value that takes part
    return Unseen(torch.cat([own.T, weak], dim=1), torch.cat([own * lengths, directions])[order], taking_part[order])


def singular_values(matrix: Tensor, asked: Tensor, blind: Tensor) -> tuple[tuple[float, ...], ...]:
    """Those of each material's Jacobian, from J^T J (M, D, D), over what is asked about (M, D), columns of unit length.

    They fall; the blind have 0.
    """
    seen, silent = asked & ~blind, (asked & blind).sum(-1).tolist()
    found: list[tuple[float, ...]] = [()] * len(matrix)
    rows_of: dict[tuple[bool, ...], list[int]] = {}
    for row, pattern in enumerate(seen.tolist()):
        rows_of.setdefault(tuple(pattern), []).append(row)
    for pattern, rows in rows_of.items():
        at = torch.tensor(pattern).nonzero()[:, 0]
        block = matrix[rows][:, at][:, :, at]
        spectrum = Spectrum.of(block, torch.ones(block.shape[:2], dtype=torch.bool))
        values = spectrum.values.clamp(min=0).sqrt().flip(1).tolist()
        for row, own in zip(rows, values, strict=True):
            found[row] = (*own, *(0.0 for _ in range(silent[row])))
    return tuple(found)


def _outer(x: Tensor) -> Tensor:
    return x.unsqueeze(-1) * x.unsqueeze(-2)


def _sparse(rows: Tensor) -> Tensor:
    """Rows (k, D) that span the same, each 0 where another has its largest entry (Gauss and Jordan)."""
    rows = rows.clone()
    waiting = list(range(len(rows)))
    while waiting:
        flat = int(rows[waiting].abs().argmax())
        i, column = waiting[flat // rows.shape[1]], flat % rows.shape[1]
        rows[i] = rows[i] / rows[i, column]
        for other in range(len(rows)):
            if other != i:
                rows[other] -= rows[other, column] * rows[i]
        waiting.remove(i)
    return rows


def named(
    problem: Problem, found: Unseen, chain: Tensor, channels: Sequence[str]
) -> tuple[tuple[str, ...], tuple[dict[str, float], ...]]:
    """What is not determined in words, and the combinations as the changes of natural values along them.

    A value alone is its key, or key[channel] where other channels determine theirs; a combination is such names in the
    order of the alphabet, joined by " with ", and where more than three channels of a key take part, but not all, it
    says in how many. Channels that share a kind of combination are named once. A change is in the parameter's own unit,
    and a combination's have length 1; `chain` (D,) makes them of the raw ones.
    """
    if not len(found.directions):
        return (), ()
    key_of = [key for key, at in problem.slices.items() for _ in range(at.start, at.stop)]
    kinds: dict[tuple[tuple[str, ...], bool], list[list[int]]] = {}
    combinations: list[dict[str, float]] = []
    for direction, part in zip(found.directions, found.taking_part, strict=True):
        at = part.nonzero()[:, 0].tolist()
        kinds.setdefault((tuple(sorted({key_of[position] for position in at})), len(at) > 1), []).append(at)
        if len(at) > 1:
            change = direction[at] * chain[at]
            weights = (change / change.norm() * change[change.abs().argmax()].sign()).tolist()
            names = [name_of(problem, position, channels) for position in at]
            combinations.append(dict(sorted(zip(names, weights, strict=True))))
    words: list[str] = []
    for (keys, together), several in kinds.items():
        union = sorted({position for at in several for position in at})
        if not together or all(_taken(problem, key, union) == _all(problem, key) for key in keys):
            several = [union]
        words += [word for at in several for word in _words(problem, keys, at, channels, together=together)]
    return tuple(words), tuple(combinations)


def _all(problem: Problem, key: str) -> list[int]:
    return list(range(problem.slices[key].start, problem.slices[key].stop))


def _taken(problem: Problem, key: str, positions: Sequence[int]) -> list[int]:
    return [position for position in _all(problem, key) if position in positions]


def _words(
    problem: Problem, keys: Sequence[str], positions: Sequence[int], channels: Sequence[str], *, together: bool
) -> list[str]:
    """The values at these positions: one name for what they make together, or the names of each alone."""
    names: list[str] = []
    for key in keys:
        taken = _taken(problem, key, positions)
        if taken == _all(problem, key):
            names.append(key)
        elif together and len(taken) > _LISTED:
            names.append(f"{key} in {len(taken)} channels")
        else:
            names += [name_of(problem, position, channels) for position in taken]
    return [" with ".join(names)] if together else names


def name_of(problem: Problem, position: int, channels: Sequence[str]) -> str:
    """What a raw position is called: its key, or key[channel] where there is one value a channel."""
    key, at = next((key, at) for key, at in problem.slices.items() if at.start <= position < at.stop)
    return f"{key}[{channels[position - at.start]}]" if problem.plan.start[key].ndim else key
