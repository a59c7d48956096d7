"""How far the brightest samples lie from the mirror direction, for tests of real files."""

import torch
from torch import Tensor

from brdfcore.formats import Samples


def from_mirror(samples: Samples) -> Tensor:
    """The angle [deg] between wo and the mirror direction of wi, (N,)."""
    mirror = samples.wi * torch.tensor([-1.0, -1.0, 1.0], dtype=torch.float64)
    return torch.rad2deg((mirror * samples.wo).sum(-1).clamp(-1, 1).acos())


def brightest(samples: Samples, count: int) -> Tensor:
    """That angle of the brightest samples, brightest first."""
    return from_mirror(samples)[samples.values.mean(-1).topk(count).indices]
