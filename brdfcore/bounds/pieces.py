"""The directions into a box, in pieces of its faces, and intervals of what the models read over each piece.

Directions into a box are the directions into the faces that the origin sees. Over a rectangle of a face the interval of
each component of wo is exact (Walter 2005, eq. 27); the half vector's slopes and h.wo follow by interval arithmetic.
"""

from typing import NamedTuple

import torch
from torch import Tensor

NEAR = 2.0**-40  # of the box's largest coordinate: a box that comes so near the origin counts as touching it

Interval = tuple[Tensor, Tensor]


class Pieces(NamedTuple):
    """What is known of the directions into pieces of faces: intervals, each end (rows, pieces, 1)."""

    ci: Tensor
    co: Interval
    p2: Interval  # squares of the half vector's slopes
    q2: Interval
    h_dot_wo: Interval
    eps: float  # of the precision whose rounding counts


def faces(low: Tensor, high: Tensor) -> Interval:
    """The faces of boxes (rows, 3) that the origin sees, above the horizon, each scaled to distance 1: (rows, 5, 3).

    For a box that holds the origin they are those of a cube round it. A face that is not seen points straight down.
    """
    below = high[:, 2:] <= 0
    scale = torch.maximum(low.abs(), high.abs()).amax(-1, keepdim=True).clamp(min=torch.finfo(low.dtype).tiny)
    low, high = low / scale, high / scale
    low = torch.where((low > 0) & (low < NEAR), 0.0, low)
    high = torch.where((high < 0) & (high > -NEAR), 0.0, high)
    low = torch.cat([low[:, :2], low[:, 2:].clamp(min=0)], dim=-1)
    inside = ((low <= 0) & (high >= 0)).all(-1, keepdim=True)
    low = torch.where(inside, low.new_tensor([-1.0, -1.0, 0.0]), low)
    high = torch.where(inside, 1.0, high)
    down = low.new_tensor([0.0, 0.0, -1.0])
    lows: list[Tensor] = []
    highs: list[Tensor] = []
    for axis, side in ((0, 1), (0, -1), (1, 1), (1, -1), (2, 1)):
        near, far = (low, high) if side > 0 else (-high, -low)
        distance = torch.where(inside, far, near)[:, axis : axis + 1]
        seen = (distance > 0) & ~below
        distance = torch.where(seen, distance, 1.0)
        is_axis = torch.arange(3, device=low.device) == axis
        for ends, corner in ((lows, low), (highs, high)):
            ends.append(torch.where(seen, torch.where(is_axis, float(side), corner / distance), down))
    return torch.stack(lows, dim=1), torch.stack(highs, dim=1)


def middle_of(low: Tensor, high: Tensor) -> Tensor:
    """The point of a piece that halves its angle along each coordinate."""
    return torch.minimum(torch.maximum(torch.tan(0.5 * (torch.atan(low) + torch.atan(high))), low), high)


def pieces_of(wi: Tensor, low: Tensor, high: Tensor, eps: float, floor: float) -> Pieces:
    """The intervals for wi (rows, 1, 3) and the pieces low <= v <= high (rows, pieces, 3) of faces.

    They hold whatever rounding may do to a direction at the precision `eps`; cosines are at least `floor`, as the
    geometry that models see has them.
    """
    margin = 8 * eps
    low2, high2 = _squared((low, high))
    low_rest, high_rest = (square.roll(1, -1) + square.roll(2, -1) for square in (low2, high2))
    lowest = low / torch.sqrt(low.square() + torch.where(low >= 0, high_rest, low_rest))
    highest = high / torch.sqrt(high.square() + torch.where(high >= 0, low_rest, high_rest))
    ci = wi[..., 2:].clamp(min=floor)
    co_low = (lowest[..., 2:] * (1 - margin)).clamp(min=floor)
    co_high = (highest[..., 2:] * (1 + margin)).clamp(min=floor)
    lowest, highest = wi + lowest - margin, wi + highest + margin  # of the half vector
    hx2, hy2 = (_squared((lowest[..., k : k + 1], highest[..., k : k + 1])) for k in (0, 1))
    hz2 = (ci + co_low).square(), (ci + co_high).square()
    return Pieces(
        ci=ci,
        co=(co_low, co_high),
        p2=(hx2[0] / hz2[1], hx2[1] / hz2[0]),
        q2=(hy2[0] / hz2[1], hy2[1] / hz2[0]),
        h_dot_wo=(
            0.5 * torch.sqrt(hx2[0] + hy2[0] + hz2[0]) * (1 - margin),
            0.5 * torch.sqrt(hx2[1] + hy2[1] + hz2[1]) * (1 + margin),
        ),
        eps=eps,
    )


def nearest(x: Tensor, interval: Interval) -> Tensor:
    """The number in the interval that is nearest to x: where a function with its only peak at x is largest."""
    return torch.minimum(torch.maximum(x, interval[0]), interval[1])


def _squared(interval: Interval) -> Interval:
    """The interval of the square."""
    low, high = interval
    low2, high2 = low.square(), high.square()
    return torch.where((low <= 0) & (high >= 0), 0.0, torch.minimum(low2, high2)), torch.maximum(low2, high2)
