"""How the noise of residuals grows with the signal: v = even + relative * signal^2, the likeliest of normal residuals.

Both parts are above 0. Beside noise that is relative, and noise that is not, they stand for what instruments do: they
add dark noise to that of the light. Found by the likelihood over a grid of the ratio of both, where the level is
known in closed form; 32 ratios from 1e-6 to 1e2 of the mean square signal lie near enough, for a factor of 1.8
between two hardly changes v anywhere.

Residuals of a model that does not fit are no noise. A lobe whose flanks are off by half their height would make noise
of half the signal, and at the peak, which the model meets and where signals are a hundred times as large, more than
all that was ever seen. So `variances` are at most ALLOWED times the mean square of the residuals next in signal: what
twenty residuals of noise show by chance is hardly ever less than a third of it, even where their signals differ.
"""

from typing import NamedTuple

import torch
from torch import Tensor

ALLOWED = 3.0  # times what residuals next in signal show
_LEAST, _MOST, _COUNT = -6.0, 2.0, 33


class Noise(NamedTuple):
    """The variance of residuals as a function of the signal, both in the residuals' unit."""

    even: float
    relative: float

    def variance(self, signal: Tensor) -> Tensor:
        """The variances at signals of any shape."""
        return self.even + self.relative * signal.square()


def noise(squares: Tensor, signal: Tensor) -> Noise:
    """The likeliest noise of residuals with these squares (n,) at these signals (n,); 0 where all squares are."""
    power = signal.square()
    typical = float(power.mean()) or 1.0
    power = power / typical
    best, least = Noise(float(squares.mean()), 0.0), torch.inf
    if best.even == 0:
        return best
    for ratio in torch.logspace(_LEAST, _MOST, _COUNT, dtype=torch.float64).tolist():
        shape = power + ratio
        level = float((squares / shape).mean())
        unlikely = len(squares) * float(torch.tensor(level).log()) + float(shape.log().sum())
        if unlikely < least:
            best, least = Noise(level * ratio, level / typical), unlikely
    return best


def variances(squares: Tensor, signal: Tensor, near: int) -> Tensor:
    """The variance of each residual, (n,): the likeliest noise, within what the `near` ones next in signal allow."""
    return torch.minimum(noise(squares, signal).variance(signal), ALLOWED * _near(squares, signal.abs(), near))


def _near(squares: Tensor, size: Tensor, near: int) -> Tensor:
    """The mean of so many squares about each one's place in the order of size, (n,); at the ends those next to it."""
    count, order = len(squares), size.argsort(stable=True)
    near = min(near, count)
    sums = torch.cat([squares.new_zeros(1), squares[order].cumsum(0)])
    first = (torch.arange(count) - near // 2).clamp(0, count - near)
    mean = torch.empty_like(squares)
    mean[order] = (sums[first + near] - sums[first]).clamp(min=0) / near
    return mean
