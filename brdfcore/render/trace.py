"""Rays among the shapes of a scene: what they meet first, whether they are blocked, and the frame where they arrive."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from .shapes import Shape, inner

NEARER = 1 - 1e-6  # a light in the plane of a shape, as in a ceiling, is in front of it
TOGETHER = 1 - 1e-12  # shares of a distance that are rounding


@dataclass(frozen=True, eq=False)
class Vertices:
    """Points where rays arrived, (N, ...): the shape, and the directions back along the rays in its frame."""

    point: Tensor  # (N, 3)
    shape: Tensor  # (N,), its index
    axes: tuple[Tensor, Tensor, Tensor]  # (N, 3) each: the material's x, y and the normal
    wo: Tensor  # (N, 3), in that frame

    def __len__(self) -> int:
        return len(self.point)

    @property
    def normal(self) -> Tensor:
        """The unit normals, (N, 3)."""
        return self.axes[2]

    def local(self, w: Tensor) -> Tensor:
        """Directions (N, 3) of the scene in the materials' frames."""
        return torch.stack([inner(w, axis) for axis in self.axes], dim=-1)

    def world(self, w: Tensor) -> Tensor:
        """Directions (N, 3) of the materials' frames in the scene."""
        return w[:, :1] * self.axes[0] + w[:, 1:2] * self.axes[1] + w[:, 2:] * self.axes[2]

    def take(self, rows: Tensor) -> "Vertices":
        """Those of the rows, which may repeat."""
        x, y, z = (axis[rows] for axis in self.axes)
        return Vertices(self.point[rows], self.shape[rows], (x, y, z), self.wo[rows])


def nearest(
    shapes: Sequence[Shape], origin: Tensor, direction: Tensor, left: Tensor | None = None
) -> tuple[Tensor, Tensor]:
    """The distance to what rays (N, 3) meet first, inf where nothing, and its index, -1 where nothing.

    Of shapes that are met together, as a rug and the floor below it, it is the first of the list. `left` is the index
    of the shape that each ray leaves, which it cannot meet again.
    """
    best = torch.full_like(origin[:, 0], torch.inf)
    index = torch.full(best.shape, -1, dtype=torch.long, device=origin.device)
    for number, shape in enumerate(shapes):
        t = shape.hit(origin, direction)
        if left is not None:
            t = torch.where(left == number, torch.inf, t)
        nearer = t < best * TOGETHER
        best, index = torch.where(nearer, t, best), torch.where(nearer, number, index)
    return best, index


def blocked(shapes: Sequence[Shape], vertices: Vertices, direction: Tensor, distance: Tensor) -> Tensor:
    """Whether a shape lies between each vertex and a light in a direction (N, 3) at a distance (N,)."""
    found = torch.zeros_like(distance, dtype=torch.bool)
    for number, shape in enumerate(shapes):
        found |= (shape.hit(vertices.point, direction) < distance * NEARER) & (vertices.shape != number)
    return found


def arrive(shapes: Sequence[Shape], shape: Tensor, point: Tensor, direction: Tensor) -> Vertices:
    """The vertices at points (N, 3) of the shapes (N,), reached along directions (N, 3)."""

    def frame(number: int, at: Tensor) -> Tensor:
        return torch.stack(shapes[number].frame(shapes[number].normal(at)), dim=1)

    axes = grouped(shape, len(shapes), frame, point)
    x, y, z = axes.unbind(1)
    bare = Vertices(point, shape, (x, y, z), point)
    return Vertices(point, shape, (x, y, z), bare.local(-direction))


def grouped(index: Tensor, count: int, compute: Callable[..., Tensor], *tensors: Tensor) -> Tensor:
    """What `compute(number, *rows of the tensors)` gives for the rows of each index, put together, (N, ...).

    Rows of results may have 1 or C entries on the last axis, and are widened to the most.
    """
    if count == 1:
        return compute(0, *tensors)
    parts, places = [], []
    for number in range(count):
        rows = torch.nonzero(index == number).squeeze(-1)
        if len(rows):
            parts.append(compute(number, *(tensor[rows] for tensor in tensors)))
            places.append(rows)
    if not parts:
        return compute(0, *tensors)
    shape = max((part.shape[1:] for part in parts), key=lambda s: s.numel())
    together = torch.cat([part.expand(len(part), *shape) for part in parts])
    return together[torch.argsort(torch.cat(places))]
