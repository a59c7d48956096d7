"""The shapes of a scene: spheres, planes and rectangles, each with a material and its tangent frame.

Every shape is convex and is seen from its outside, to which its normal points; its back is black. So a ray that leaves
a shape's outside never meets the same shape again, and no distance has to be held off against rounding; a plane is not
met from where it is, as by rays that leave a rug on a floor. `hit` returns distances along unit directions, inf where
there is none. The material's x axis is the part of `tangent` that lies in
the surface; where nothing of it does, at the poles of a sphere, it is any direction.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import torch
from torch import Tensor

from ..errors import InvalidValueError
from ..models.material import Material, check_material, material
from ..tabulated import Tabulated
from . import _checks
from ._checks import Vector

IN_PLANE = 1e-12  # of the distance to a plane's point: a height that is rounding


@dataclass(frozen=True, eq=False, kw_only=True)
class Shape(ABC):
    """What shapes share: a material or a text of one, the tangent of its x axis, and a name for the plan."""

    material: Material | Tabulated
    tangent: Vector | None = None
    name: str = ""

    def __post_init__(self) -> None:
        if isinstance(self.material, str):
            object.__setattr__(self, "material", material(self.material))
        if not isinstance(self.material, Tabulated):
            check_material(self.material)
        if self.tangent is not None:
            object.__setattr__(self, "tangent", _checks.direction("tangent", self.tangent))
        if not isinstance(self.name, str):
            raise InvalidValueError(
                f"Expected name to be a text, got {self.name!r}. Leave it out or write one.", field="name"
            )

    @property
    def along(self) -> Vector:
        """The direction whose part in the surface is the material's x axis."""
        return self.tangent or (0.0, 0.0, 1.0)

    @abstractmethod
    def hit(self, origin: Tensor, direction: Tensor) -> Tensor:
        """The distance along rays (..., 3) to the shape, (...); inf where they miss it."""

    @abstractmethod
    def normal(self, point: Tensor) -> Tensor:
        """The unit normal at points (..., 3) on the shape."""

    @abstractmethod
    def contains(self, point: Vector) -> bool:
        """Whether a point lies inside."""

    @abstractmethod
    def distance(self, point: Vector) -> float:
        """The distance to a point outside, or less."""

    def frame(self, normal: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """The axes x, y, z of the material at points of these normals (..., 3)."""
        along = normal.new_tensor(self.along).expand_as(normal)
        x = along - inner(along, normal).unsqueeze(-1) * normal
        length = x.norm(dim=-1, keepdim=True)
        other = perpendicular(normal)
        x = torch.where(length > 1e-9, x / length.clamp(min=1e-9), other)  # shorter ones are rounding
        return x, torch.linalg.cross(normal, x), normal


@dataclass(frozen=True, eq=False, kw_only=True)
class Sphere(Shape):
    """A sphere; x runs along the meridians whose pole is `tangent`, by default upwards along z."""

    center: Vector
    radius: float

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "center", _checks.vector("center", self.center))
        object.__setattr__(self, "radius", _checks.positive("radius", self.radius))

    def hit(self, origin: Tensor, direction: Tensor) -> Tensor:
        """The nearer intersection in front of the origin."""
        return sphere_distance(origin, direction, self.center, self.radius)

    def normal(self, point: Tensor) -> Tensor:
        """Outwards from the centre."""
        return torch.nn.functional.normalize(point - point.new_tensor(self.center), dim=-1)

    def contains(self, point: Vector) -> bool:
        """Whether the point is nearer to the centre than the radius."""
        return math.dist(point, self.center) <= self.radius

    def distance(self, point: Vector) -> float:
        """To the surface."""
        return math.dist(point, self.center) - self.radius


@dataclass(frozen=True, eq=False, kw_only=True)
class Plane(Shape):
    """An endless plane through `point`, and all that lies below it."""

    point: Vector = (0.0, 0.0, 0.0)
    normal_direction: Vector = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "point", _checks.vector("point", self.point))
        object.__setattr__(self, "normal_direction", _checks.direction("normal_direction", self.normal_direction))

    @property
    def along(self) -> Vector:
        """The world's x axis unless a tangent is given."""
        return self.tangent or (1.0, 0.0, 0.0)

    def hit(self, origin: Tensor, direction: Tensor) -> Tensor:
        """The intersection in front of the origin."""
        return plane_distance(origin, direction, self.point, self.normal_direction)

    def normal(self, point: Tensor) -> Tensor:
        """The plane's."""
        return point.new_tensor(self.normal_direction).expand_as(point)

    def contains(self, point: Vector) -> bool:
        """Whether the point is not above the plane."""
        return self.distance(point) <= 0

    def distance(self, point: Vector) -> float:
        """The height above the plane."""
        return dot(minus(point, self.point), self.normal_direction)


@dataclass(frozen=True, eq=False, kw_only=True)
class Rectangle(Shape):
    """A rectangle about `center` with two edges at right angles; its outside is the side of edge_u x edge_v."""

    center: Vector
    edge_u: Vector
    edge_v: Vector

    def __post_init__(self) -> None:
        super().__post_init__()
        check_rectangle(self)

    @property
    def along(self) -> Vector:
        """The first edge unless a tangent is given."""
        return self.tangent or self.edge_u

    def hit(self, origin: Tensor, direction: Tensor) -> Tensor:
        """The intersection in front of the origin."""
        return rectangle_distance(origin, direction, self.center, self.edge_u, self.edge_v)

    def normal(self, point: Tensor) -> Tensor:
        """Along edge_u x edge_v."""
        return point.new_tensor(cross(self.edge_u, self.edge_v)).expand_as(point)

    def contains(self, point: Vector) -> bool:
        """Nothing lies inside a rectangle."""
        return False

    def distance(self, point: Vector) -> float:
        """To the plane of the rectangle, or to the sphere about it, whichever is more."""
        height = abs(dot(minus(point, self.center), cross(self.edge_u, self.edge_v)))
        half = (dot(self.edge_u, self.edge_u) + dot(self.edge_v, self.edge_v)) ** 0.5 / 2
        beside = math.dist(point, self.center) - half
        return height if height > beside else beside


def check_rectangle(shape: object) -> None:
    """Replace a rectangle's fields by checked ones, or raise."""
    for name in ("center", "edge_u", "edge_v"):
        object.__setattr__(shape, name, _checks.vector(name, getattr(shape, name)))
    u, v = getattr(shape, "edge_u"), getattr(shape, "edge_v")  # noqa: B009 - of shapes and of lights
    area = math.hypot(*u) * math.hypot(*v)
    if area == 0:
        raise InvalidValueError(
            f"Expected edge_u and edge_v to span an area above 0, got {list(u)} and {list(v)}. Lengthen them.",
            field="edge_u",
        )
    if abs(dot(u, v)) > 1e-6 * area:
        raise InvalidValueError(
            f"Expected edge_v to be at right angles to edge_u, got {list(v)} beside {list(u)}. Turn it.",
            field="edge_v",
        )


def sphere_distance(origin: Tensor, direction: Tensor, center: Vector, radius: float) -> Tensor:
    """The distance to a sphere, (...); the discriminant is the radius's square less that of the closest approach."""
    to_center = origin.new_tensor(center) - origin
    closest = inner(to_center, direction)
    miss = to_center - closest.unsqueeze(-1) * direction
    rest = radius * radius - inner(miss, miss)
    half = torch.sqrt(rest.clamp(min=0))
    near, far = closest - half, closest + half
    t = torch.where(near > 0, near, far)
    return torch.where((rest > 0) & (t > 0), t, torch.inf)


def plane_distance(origin: Tensor, direction: Tensor, point: Vector, normal: Vector) -> Tensor:
    """The distance to a plane, (...)."""
    n, to_point = origin.new_tensor(normal), origin.new_tensor(point) - origin
    slope, height = inner(direction, n), inner(to_point, n)
    t = height / torch.where(slope == 0, 1.0, slope)
    away = height.square() > IN_PLANE**2 * inner(to_point, to_point)
    return torch.where((slope != 0) & (t > 0) & away, t, torch.inf)


def rectangle_distance(origin: Tensor, direction: Tensor, center: Vector, u: Vector, v: Vector) -> Tensor:
    """The distance to a rectangle, (...)."""
    t = plane_distance(origin, direction, center, cross(u, v))
    at = origin + torch.where(t.isinf(), 0.0, t).unsqueeze(-1) * direction - origin.new_tensor(center)
    inside = ~t.isinf()
    for edge in (u, v):
        e = origin.new_tensor(edge)
        inside &= inner(at, e).abs() <= 0.5 * inner(e, e)
    return torch.where(inside, t, torch.inf)


def inner(a: Tensor, b: Tensor) -> Tensor:
    """The scalar products (...) of vectors (..., 3); a sum over so short an axis would take six times as long."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def cross(u: Vector, v: Vector) -> Vector:
    """The unit vector along u x v, of vectors of any length."""
    u, v = _checks.direction("edge_u", u), _checks.direction("edge_v", v)
    return _checks.direction(
        "edge_u x edge_v", [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    )


def perpendicular(normal: Tensor) -> Tensor:
    """A unit vector at right angles to each normal (..., 3)."""
    x, y, z = normal.unbind(-1)
    zero = torch.zeros_like(x)
    flat = torch.where((z.abs() < 0.7).unsqueeze(-1), torch.stack([-y, x, zero], -1), torch.stack([z, zero, -x], -1))
    return torch.nn.functional.normalize(flat, dim=-1)


def dot(a: Vector, b: Vector) -> float:
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def minus(a: Vector, b: Vector) -> Vector:
    """The difference."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])
