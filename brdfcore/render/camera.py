"""A pinhole camera: where the rays of an image go."""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from ..errors import InvalidValueError
from . import _checks
from ._checks import Vector

LARGEST = 16384  # pixels along an edge
RAYS = 2**24  # of an image, each of which is held in memory


@dataclass(frozen=True, kw_only=True)
class Camera:
    """A pinhole at `position` that looks at `look_at`; `fov_deg` is the vertical angle of the image [degrees].

    A pixel is the mean of grid x grid rays in a fixed raster; 1 sends one ray through its centre.
    """

    position: Vector
    look_at: Vector
    width: int
    height: int
    fov_deg: float = 30.0
    up: Vector = (0.0, 0.0, 1.0)
    grid: int = 1

    def __post_init__(self) -> None:
        for name in ("position", "look_at"):
            object.__setattr__(self, name, _checks.vector(name, getattr(self, name)))
        object.__setattr__(self, "up", _checks.direction("up", self.up))
        for name in ("width", "height"):
            _checks.whole(name, getattr(self, name), 1, LARGEST)
        _checks.whole("grid", self.grid, 1, 16)
        if (rays := self.width * self.height * self.grid**2) > RAYS:
            raise InvalidValueError(
                f"Expected width x height x grid^2 to be at most {RAYS:,} rays, got {rays:,}. "
                "Lower the grid, or render parts.",
                field="width",
            )
        if not 0 < _checks.positive("fov_deg", self.fov_deg) < 180:
            raise InvalidValueError(
                f"Expected fov_deg to be above 0 and below 180, got {self.fov_deg:g}. Narrow it.", field="fov_deg"
            )
        forward = torch.tensor(self.look_at, dtype=torch.float64) - torch.tensor(self.position, dtype=torch.float64)
        side = torch.linalg.cross(forward, torch.tensor(self.up, dtype=torch.float64))
        if float(side.norm()) <= 1e-9 * float(forward.norm()):
            raise InvalidValueError(
                f"Expected look_at to differ from position, and not along up, got {list(self.look_at)}. "
                "Move it, or turn up.",
                field="look_at",
            )

    def rays(self, device: torch.device | str = "cpu") -> Tensor:
        """The unit directions of all rays, (height, width, grid^2, 3), in double precision."""
        place = torch.zeros((), dtype=torch.float64, device=device)
        forward = torch.nn.functional.normalize(place.new_tensor(self.look_at) - place.new_tensor(self.position), dim=0)
        right = torch.nn.functional.normalize(torch.linalg.cross(forward, place.new_tensor(self.up)), dim=0)
        above = torch.linalg.cross(right, forward)
        n, half = self.grid, math.tan(math.radians(self.fov_deg) / 2)
        columns, rows = (torch.arange(count * n, device=device).to(place) + 0.5 for count in (self.width, self.height))
        x = (columns / n - self.width / 2) * (2 * half / self.height)
        y = (self.height / 2 - rows / n) * (2 * half / self.height)
        rays = forward + x[None, :, None] * right + y[:, None, None] * above
        rays = rays.reshape(self.height, n, self.width, n, 3).transpose(1, 2).reshape(self.height, self.width, n * n, 3)
        return torch.nn.functional.normalize(rays, dim=-1)
