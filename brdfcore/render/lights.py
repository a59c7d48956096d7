"""The lights of a scene. They add to what is behind them and block nothing, so each light's share is its own.

Directional and point lights are met by no ray and are evaluated in closed form: `arriving` gives the direction to the
light, its distance, and what it does to a surface that faces it, an irradiance per unit of its strength. The others
have an extent: `sample` draws directions to them with their density per solid angle [1/sr], and `met` says where rays
meet them and what that density is there. All broadcast over points (..., 3).
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import torch
from torch import Tensor

from . import _checks
from ._checks import Colour, Vector
from .shapes import check_rectangle, cross, inner, perpendicular, rectangle_distance, sphere_distance


class Light(ABC):
    """What lights share: the field that holds their strength, one number or three."""

    strength: ClassVar[str]

    def colour(self, like: Tensor) -> Tensor:
        """The strength, (1,) or (3,), differentiable where it was given as a tensor."""
        return _checks.as_tensor(getattr(self, self.strength), like)

    def _check_strength(self) -> None:
        _checks.colour(self.strength, getattr(self, self.strength))


class DeltaLight(Light):
    """A light without an extent."""

    @abstractmethod
    def arriving(self, point: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """The direction to the light (..., 3), its distance (...), and the irradiance per strength (...)."""


class AreaLight(Light):
    """A light with an extent, and one radiance [W/m^2/sr] all over."""

    strength = "radiance"

    @abstractmethod
    def sample(self, point: Tensor, normal: Tensor, u: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Directions (..., 3), distances (...) and densities [1/sr] (...), 0 where the light is not seen."""

    @abstractmethod
    def met(self, point: Tensor, normal: Tensor, direction: Tensor) -> tuple[Tensor, Tensor]:
        """Where rays meet the light: the distance, inf where they miss it, and the density of `sample` [1/sr]."""

    @abstractmethod
    def seen(self, origin: Tensor, direction: Tensor) -> Tensor:
        """The distance along rays to the light, (...); inf where they miss it."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Directional(DeltaLight):
    """Parallel light from `direction`, which points to it; irradiance [W/m^2] of a surface that faces it."""

    direction: Vector
    irradiance: Colour
    strength = "irradiance"

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", _checks.direction("direction", self.direction))
        self._check_strength()

    def arriving(self, point: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """The same everywhere."""
        far = torch.full_like(point[..., 0], torch.inf)
        return point.new_tensor(self.direction).expand_as(point), far, torch.ones_like(far)


@dataclass(frozen=True, eq=False, kw_only=True)
class Point(DeltaLight):
    """A point that shines evenly with an intensity [W/sr]."""

    position: Vector
    intensity: Colour
    strength = "intensity"

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", _checks.vector("position", self.position))
        self._check_strength()

    def arriving(self, point: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Falls with the square of the distance."""
        to_light = point.new_tensor(self.position) - point
        distance = to_light.norm(dim=-1).clamp(min=1e-30)
        return to_light / distance.unsqueeze(-1), distance, distance**-2


@dataclass(frozen=True, eq=False, kw_only=True)
class RectangleLight(AreaLight):
    """A rectangle that shines from its side of edge_u x edge_v, sampled evenly by its area."""

    center: Vector
    edge_u: Vector
    edge_v: Vector
    radiance: Colour

    def __post_init__(self) -> None:
        check_rectangle(self)
        self._check_strength()

    def sample(self, point: Tensor, normal: Tensor, u: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Points of the rectangle."""
        a, b = point.new_tensor(self.edge_u), point.new_tensor(self.edge_v)
        at = point.new_tensor(self.center) + (u[..., :1] - 0.5) * a + (u[..., 1:] - 0.5) * b
        to_light = at - point
        distance = to_light.norm(dim=-1).clamp(min=1e-30)
        wi = to_light / distance.unsqueeze(-1)
        return wi, distance, self._density(wi, distance)

    def met(self, point: Tensor, normal: Tensor, direction: Tensor) -> tuple[Tensor, Tensor]:
        """From the front only."""
        t = self.seen(point, direction)
        density = self._density(direction, torch.where(t.isinf(), 1.0, t))
        return t, torch.where(t.isinf(), 0.0, density)

    def seen(self, origin: Tensor, direction: Tensor) -> Tensor:
        """From the front only."""
        t = rectangle_distance(origin, direction, self.center, self.edge_u, self.edge_v)
        facing = inner(direction, origin.new_tensor(cross(self.edge_u, self.edge_v))) < 0
        return torch.where(facing, t, torch.inf)

    def _density(self, wi: Tensor, distance: Tensor) -> Tensor:
        """The density distance^2 / (area cosine) [1/sr]."""
        cosine = -inner(wi, wi.new_tensor(cross(self.edge_u, self.edge_v)))
        area = math.hypot(*self.edge_u) * math.hypot(*self.edge_v)
        return torch.where(cosine > 0, distance.square() / (area * torch.where(cosine > 0, cosine, 1.0)), 0.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class SphereLight(AreaLight):
    """A sphere that shines outwards, sampled evenly by the solid angle under which it is seen."""

    center: Vector
    radius: float
    radiance: Colour

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", _checks.vector("center", self.center))
        object.__setattr__(self, "radius", _checks.positive("radius", self.radius))
        self._check_strength()

    def sample(self, point: Tensor, normal: Tensor, u: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Directions of the cone about the centre; its height 1 - cos is formed without cancelling."""
        to_center = point.new_tensor(self.center) - point
        z = torch.nn.functional.normalize(to_center, dim=-1)
        height = self._height(point)
        lower = u[..., 0] * height  # 1 - cos of the angle to the axis
        sine = torch.sqrt((lower * (2 - lower)).clamp(min=0))
        turn = 2 * math.pi * u[..., 1]
        x = perpendicular(z)
        y = torch.linalg.cross(z, x)
        parts = (sine * torch.cos(turn), sine * torch.sin(turn), 1 - lower)
        wi = sum(part.unsqueeze(-1) * axis for part, axis in zip(parts, (x, y, z), strict=True))
        assert isinstance(wi, Tensor)  # noqa: S101 - for mypy: sum may return 0
        # a direction at the cone's rim may miss by rounding: it is as far as the rim
        t = self.seen(point, wi)
        rim = torch.sqrt((inner(to_center, to_center) - self.radius**2).clamp(min=0))
        return wi, torch.where(t.isinf(), rim, t), 1 / (2 * math.pi * height)

    def met(self, point: Tensor, normal: Tensor, direction: Tensor) -> tuple[Tensor, Tensor]:
        """From outside or inside."""
        t = self.seen(point, direction)
        return t, torch.where(t.isinf(), 0.0, 1 / (2 * math.pi * self._height(point)))

    def seen(self, origin: Tensor, direction: Tensor) -> Tensor:
        """The nearer intersection in front of the origin."""
        return sphere_distance(origin, direction, self.center, self.radius)

    def _height(self, point: Tensor) -> Tensor:
        """The height 1 - cos of the cone, 2 from inside the sphere."""
        to_center = point.new_tensor(self.center) - point
        d2 = inner(to_center, to_center)
        sine2 = (self.radius**2 / d2).clamp(max=1)
        return torch.where(sine2 < 1, sine2 / (1 + torch.sqrt(1 - sine2)), 2.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class Dome(AreaLight):
    """Even light from everywhere, sampled by the cosine."""

    radiance: Colour

    def __post_init__(self) -> None:
        self._check_strength()

    def sample(self, point: Tensor, normal: Tensor, u: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Directions of the hemisphere about the normal."""
        r, turn = torch.sqrt(u[..., :1]), 2 * math.pi * u[..., 1:]
        x = perpendicular(normal)
        y = torch.linalg.cross(normal, x)
        cosine = torch.sqrt(1 - u[..., :1])
        wi = r * torch.cos(turn) * x + r * torch.sin(turn) * y + cosine * normal
        return wi, torch.full_like(cosine[..., 0], torch.finfo(point.dtype).max), cosine[..., 0] / math.pi

    def met(self, point: Tensor, normal: Tensor, direction: Tensor) -> tuple[Tensor, Tensor]:
        """Every ray does, beyond everything."""
        cosine = inner(direction, normal)
        return self.seen(point, direction), cosine.clamp(min=0) / math.pi

    def seen(self, origin: Tensor, direction: Tensor) -> Tensor:
        """Beyond everything, nearer than a miss."""
        return torch.full_like(origin[..., 0], torch.finfo(origin.dtype).max)
