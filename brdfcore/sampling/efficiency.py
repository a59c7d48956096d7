"""What the weights of a material's samples are worth: their mean, variance and largest, and what the horizon takes.

    w = f(wi, wo) cos theta_i / pdf(wi, wo),  wi = sample(wo, u)                                                [1]
    effective = (sum w)^2 / (n sum w^2) = 1 / (1 + variance / mean^2)                                           [1]

The mean estimates the directional albedo, and sqrt(variance / n) is the error of the radiance that n samples estimate
in even light. Kurt, Szirmay-Kalos and Krivanek 2010, section 6, compare models by it, in pictures; Walter 2005,
section 2 and Fig. 3, says what neglecting w costs. A sample below the horizon counts with w = 0: it takes its time and
brings nothing, but drawing it again would bias the mean.
"""

import time
from dataclasses import dataclass

import torch
from torch import Tensor

from .._types import Density, Directions, Spectrum
from ..errors import InvalidValueError
from ..geometry import check_directions
from ..models.material import Material, check_material

COUNT = 65536  # samples for each direction: the mean to about 0.4 % of the weights' deviation
BLOCK = 2**18  # weights at a time, for the memory


@dataclass(frozen=True, eq=False)
class Efficiency:
    """The weights of `count` samples for each wo: double precision on the CPU, whatever the directions' are."""

    mean: Spectrum  # (..., C) [1], estimates the directional albedo
    variance: Spectrum  # (..., C) [1] of one weight
    largest: Spectrum  # (..., C) [1]
    effective: Spectrum  # (..., C) [1], the share of even-weighted samples that would be worth as much; 0 where w is 0
    lost: Density  # (...) [1], the share of samples at or below the horizon
    count: int
    seconds: float  # that sampling and weighing took

    @property
    def standard_error(self) -> Spectrum:
        """The standard error of the mean [1], (..., C)."""
        return torch.sqrt(self.variance / self.count)


def efficiency(material: Material, wo: Directions, count: int = COUNT, seed: int = 0) -> Efficiency:
    """The mean, variance and largest of the weights [1] of `count` samples for each wo (..., 3), and the share lost.

    Every wo and every material gets the same `count` triples u, drawn from `seed`: comparisons are not blurred by
    different luck, and a wo's numbers do not depend on what else is asked for. Weights are taken in wo's precision.
    Raises InvalidValueError for what is no Material, for a wo that is not finite and above the horizon, and for a count
    below 2.
    """
    check_material(material)
    check_directions("wo", wo)
    wrong = ~((wo[..., 2] > 0) & wo.isfinite().all(-1))
    if bool(wrong.any()):
        raise InvalidValueError(
            f"Expected wo to be finite and above the horizon, got {wo[wrong][0].tolist()}. "
            "Leave it out: it has no samples.",
            field="wo",
        )
    if isinstance(count, bool) or not isinstance(count, int) or count < 2:
        raise InvalidValueError(
            f"Expected count to be a whole number of at least 2, got {count!r}. A variance needs two samples.",
            field="count",
        )
    u = torch.rand(count, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(seed)).to(wo.device)
    rows = wo.detach().reshape(-1, 1, 3)
    start = time.perf_counter()
    mean, spread, largest = (wo.new_zeros(len(rows), material.channels, dtype=torch.float64) for _ in range(3))
    lost, done = mean.new_zeros(len(rows)), 0
    with torch.no_grad():
        for block in u.split(max(1, BLOCK // max(1, mean.numel()))):
            weights, below = _weights(material, rows, block)
            step = weights.mean(1) - mean
            # the sum of squared deviations from the mean, joined block by block: no digits cancel
            spread += (weights - weights.mean(1, keepdim=True)).square().sum(1)
            spread += step.square() * (done * len(block) / (done + len(block)))
            done += len(block)
            mean += step * (len(block) / done)
            largest, lost = torch.maximum(largest, weights.amax(1)), lost + below
        second = mean.square() + spread / count
        effective = torch.where(second > 0, mean.square() / torch.where(second > 0, second, 1.0), 0.0)
        mean, variance, largest, effective = (
            x.reshape(*wo.shape[:-1], x.shape[-1]).cpu() for x in (mean, spread / (count - 1), largest, effective)
        )
        share = (lost / count).reshape(wo.shape[:-1]).cpu()
    return Efficiency(mean, variance, largest, effective, share, count, time.perf_counter() - start)


def _weights(material: Material, wo: Tensor, u: Tensor) -> tuple[Tensor, Tensor]:
    """The weights (rows, samples, C) in double precision, and how many samples of each row are lost (rows)."""
    shape = (len(wo), len(u), 3)
    wi = material.sample(wo.expand(shape), u.expand(shape))
    return material.weight(wi, wo).double(), (wi[..., 2] <= 0).sum(1)
