"""Which samples are left out together: whole incidences, or where the data have no such, blocks of directions.

Neighbours in a scan share their errors of alignment, and a sample's neighbours give it away: leaving out single samples
flatters a model. So what is left out is

    whole incidences                         where there are enough of them, of several samples each
    bands of theta_i, and of phi_i where     where nearly every sample has an incidence of its own, as in tables over
    the sample was turned                    the half vector (MERL)
    runs of neighbouring wo                  where there are too few incidences

dealt to the folds so that each holds small and large angles alike.
"""

import math

import torch
from torch import Tensor

from ..errors import SamplesError
from ..formats.samples import Samples, angles

_SAME = math.radians(0.05)  # incidences nearer than this are one: goniometers and files round their angles
_SEVERAL = 4  # samples of an incidence, on average; with fewer, incidences are no blocks
_BLOCKS = 4  # bands or runs in a fold, where blocks are made
_TURNS = 4  # bands of phi_i, modulo 180 deg, beside those of theta_i


def split(samples: Samples, folds: int, seed: int) -> tuple[Tensor, Tensor]:
    """The block of each sample and the fold that it is left out in, each (N,); raises SamplesError for one block."""
    block = blocks(samples, folds)
    if int(block.max()) == 0:
        raise SamplesError(
            "Expected samples to hold several directions, so that some can be left out, got one. Measure more, or name "
            "one model.",
            field="samples",
        )
    return block, dealt(block, samples, folds, seed)


def blocks(samples: Samples, folds: int) -> Tensor:
    """The number of the block that each sample belongs to, (N,), from 0 on; at least `folds` blocks if N allows."""
    theta, phi = angles(samples.wi)
    turned = samples.azimuth_observed
    place = samples.wi if turned else torch.stack([theta.sin(), theta.cos()], -1)  # isotropy: turns are repeats
    exact: Tensor = torch.unique((place / _SAME).round(), dim=0, return_inverse=True)[1]
    count = int(exact.max()) + 1
    if count >= folds and len(samples) >= _SEVERAL * count:
        return exact
    if count >= folds:
        bands = _bands(theta, _BLOCKS * folds)
        return _dense(bands * _TURNS + _bands(torch.remainder(phi, math.pi), _TURNS)) if turned else bands
    theta_o, phi_o = angles(samples.wo)
    along = theta_o * torch.where((phi_o - phi).cos() < 0, 1.0, -1.0)  # from backward to forward
    return _dense(exact * (_BLOCKS * folds) + _bands(along, _BLOCKS * folds))


def dealt(block: Tensor, samples: Samples, folds: int, seed: int) -> Tensor:
    """The fold that each sample is left out in, (N,), from 0 on: of `folds` blocks next in theta_i each gets one."""
    count = int(block.max()) + 1
    sizes = torch.zeros(count, dtype=torch.float64).index_add_(0, block, torch.ones(len(block), dtype=torch.float64))
    theta = torch.zeros(count, dtype=torch.float64).index_add_(0, block, angles(samples.wi)[0]) / sizes
    order = theta.argsort(stable=True)
    generator = torch.Generator().manual_seed(seed)
    deals = [torch.randperm(folds, generator=generator) for _ in range(0, count, folds)]
    fold = torch.empty(count, dtype=torch.long)
    fold[order] = torch.cat(deals)[:count]
    return _dense(fold[block])


def _bands(x: Tensor, count: int) -> Tensor:
    """The number of the band of about equally many samples that each x lies in; equal x share theirs."""
    edges = torch.quantile(x[:: max(1, len(x) // 100_000)], torch.linspace(0, 1, count + 1, dtype=x.dtype)[1:-1])
    return _dense(torch.bucketize(x, edges.unique()))


def _dense(labels: Tensor) -> Tensor:
    """The labels, numbered from 0 on without gaps."""
    found: Tensor = torch.unique(labels, return_inverse=True)[1]
    return found
