"""What residuals are computed from: the samples of one material or several that share their directions."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from ..formats.samples import Samples
from ..geometry import Geometry, geometry
from .losses import Loss, Scales

Rows = slice
_CHUNK = 65536  # samples times starts of one piece: what a basis computes on the way stays in the cache
_FEWEST = 8  # starts of one piece, where there are as many: they share what the directions decide


@dataclass(frozen=True)
class Data:
    """The samples of M materials, or a piece of them; N stands last, so that sums over the samples are contiguous."""

    g: Geometry  # quantities (N, 1)
    c: Tensor  # (N,) cos theta_i
    y: Tensor  # (M, C, N)
    root_weight: Tensor  # (M, C, N), (1, 1, N) or between, square roots of the weights
    root_factor: Tensor  # (M, 1, N) or (1, 1, N), of those what counts a sample: 1 where sigma made them
    sigma: Tensor | None  # (M, C, N)
    scales: Scales

    @classmethod
    def of(cls, samples: Sequence[Samples], needs: frozenset[str], loss: Loss, scales: Scales | None) -> "Data":
        """The data of samples with equal directions; the scales are theirs unless they are given."""
        first = samples[0]
        c, y = first.wi[:, 2].contiguous(), torch.stack([one.values.T for one in samples])
        sigmas = [one.sigma.T for one in samples if one.sigma is not None]
        return cls(
            geometry(first.wi, first.wo, needs),
            c,
            y,
            stacked_weights(samples, loss).sqrt() if not sigmas else _alike([root_weights(s, loss) for s in samples]),
            stacked_weights(samples, loss).sqrt() if not sigmas else _alike([root_factors(s, loss) for s in samples]),
            torch.stack(sigmas) if len(sigmas) == len(samples) else None,
            scales or Scales.stacked(y, c),
        )

    @property
    def counted(self) -> Tensor:
        """What makes a weighted residual of one: the root of its weight as a factor, 1 where that is 0."""
        return torch.where(self.root_factor > 0, self.root_factor, 1.0)

    def slice(self, begin: int, end: int) -> "Data":
        """The samples from begin to end."""
        return Data(
            Geometry(*(None if q is None else q[begin:end] for q in self.g)),
            self.c[begin:end],
            self.y[..., begin:end],
            self.root_weight[..., begin:end],
            self.root_factor[..., begin:end],
            None if self.sigma is None else self.sigma[..., begin:end],
            self.scales,
        )

    def rows(self, which: Tensor) -> "Data":
        """The data of the materials that the index (S,) names, one a row."""
        if len(self.y) == 1:
            return self  # broadcasts
        return Data(
            self.g,
            self.c,
            self.y.index_select(0, which),
            self.root_weight if len(self.root_weight) == 1 else self.root_weight.index_select(0, which),
            self.root_factor if len(self.root_factor) == 1 else self.root_factor.index_select(0, which),
            None if self.sigma is None else self.sigma.index_select(0, which),
            self.scales.rows(which),
        )

    def chunks(self, starts: int) -> Iterator["Data"]:
        """The data in pieces small enough for so many starts at once."""
        return (piece for _, piece in self.places(starts))

    def places(self, starts: int) -> Iterator[tuple[int, "Data"]]:
        """Those pieces, each with the number of its first sample."""
        count = len(self.c)
        step = max(1, _CHUNK // max(1, starts))
        for begin in range(0, count, step):
            yield begin, self.slice(begin, min(begin + step, count)) if step < count else self

    def blocks(self, starts: int, width: int = 1) -> Iterator[tuple[Rows, int, "Data"]]:
        """Which of the starts, the first sample and the piece, so that all of it is small where a start counts `width`.

        Starts are parted before samples: sums over many samples at once cost least.
        """
        rows = max(1, min(starts, max(_FEWEST, _CHUNK // len(self.c)) // width))
        for first in range(0, starts, rows):
            at = slice(first, min(first + rows, starts))
            for begin, piece in self.places((at.stop - at.start) * width):
                yield at, begin, piece


def _alike(several: Sequence[Tensor]) -> Tensor:
    """The weights (N, 1) or (N, C) of several materials, (M, 1, N) or (M, C, N), and M = 1 where they are equal."""
    if all(torch.equal(one, several[0]) for one in several[1:]):
        several = several[:1]
    return torch.stack([one.T for one in several])


def stacked_weights(samples: Sequence[Samples], loss: Loss) -> Tensor:
    """The weights of several materials, (M, 1, N), or (1, 1, N) where they are equal."""
    if all(one.weight is None and one.cell is None for one in samples):
        samples = samples[:1]
    return _alike([weights(one, loss) for one in samples])


def weights(samples: Samples, loss: Loss) -> Tensor:
    """The weights w of the loss's definition, (N, 1): the data's, else 1, times a grid cell's measure."""
    own = samples.weight if samples.weight is not None else torch.ones(len(samples), dtype=torch.float64)
    if loss.uses_cells and samples.cell is not None:
        own = own * samples.cell
    return own.unsqueeze(-1)


def root_weights(samples: Samples, loss: Loss) -> Tensor:
    """Square roots of the weights that a fit uses, (N, 1) or (N, C).

    With a known sigma and no weight, a statistical loss weighs by the inverse variance of c y: that is chi-square.
    """
    if samples.sigma is not None and is_weighed(samples, loss):
        return 1 / (samples.wi[:, 2:] * samples.sigma)
    return weights(samples, loss).sqrt()


def root_factors(samples: Samples, loss: Loss) -> Tensor:
    """What of those counts a sample and does not measure its residual by its noise, (N, 1): 1 where sigma weighs."""
    own = weights(samples, loss).sqrt()
    return torch.ones_like(own) if is_weighed(samples, loss) else own


def is_weighed(samples: Samples, loss: Loss) -> bool:
    """Whether the samples' sigma weighs the loss."""
    return loss.statistical and samples.sigma is not None and samples.weight is None
