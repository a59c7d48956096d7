"""Samples by their angle of incidence: each angle where there are few, else bands that hold as many samples each."""

import itertools
from typing import NamedTuple

import torch
from torch import Tensor

from ..formats.samples import Samples

MOST = 6  # groups


class Incidences(NamedTuple):
    """The samples of one angle of incidence, counted to a degree, or of a band of them."""

    low: float  # [deg]
    high: float
    chosen: Tensor  # (N,) bool

    @property
    def title(self) -> str:
        """The angles in words."""
        return f"incidence {self.low:g}°" + (f" to {self.high:g}°" if self.high > self.low else "")


def incidences(samples: Samples) -> list[Incidences]:
    """Up to six groups of the samples, by rising angle, that hold every one of them once."""
    theta = torch.rad2deg(torch.atan2(torch.hypot(samples.wi[:, 0], samples.wi[:, 1]), samples.wi[:, 2]))
    whole = theta.round()
    if len(found := whole.unique()) <= MOST:
        return [Incidences(float(angle), float(angle), whole == angle) for angle in found]
    ends = theta.sort().values[torch.linspace(0, len(theta) - 1, MOST + 1).round().long()].round().unique()
    ends[0], ends[-1] = theta.min().floor(), theta.max().ceil()
    return [
        Incidences(float(low), float(high), (theta >= low) & ((theta < high) | (high == ends[-1])))
        for low, high in itertools.pairwise(ends)
    ]
