"""What parts of a material contribute to an image at most: the bounds on which the plan rests.

Of a light with an extent, of radiance L and irradiance E, a part reflects at most L times its albedo, and at most E
times its largest f cos theta_i. Of a light without extent it reflects f cos theta_i E, which is evaluated at the points
and directions that the camera sees. What a part does between objects is bounded by the albedos,
as a geometric series (plan.py).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from .lights import AreaLight, DeltaLight, Directional, RectangleLight, SphereLight
from .lights import Point as PointLight
from .measured import AnySurface
from .scene import Scene
from .trace import Vertices, arrive, nearest

ANGLES = 17  # at which albedos are looked at; they change slowly
GRAZING = math.radians(89.99)
FIRST = 256  # points at which a part is looked at first: one that shows there is not looked at elsewhere
TILE = 2**16
ROUGH = 1e-2  # tolerance of albedos where two digits are enough


@dataclass(frozen=True, eq=False)
class Seen:
    """What the camera sees of one material."""

    vertices: Vertices | None  # None where no light without extent asks for them
    farthest: float  # from the normal, of the directions of view [rad]


def seen(scene: Scene, surface_of: Sequence[int], count: int) -> list[Seen]:
    """The visible points of each material, one for each ray of the camera."""
    rays = scene.camera.rays().reshape(-1, 3)
    found: list[list[Vertices]] = [[] for _ in range(count)]
    lowest = [1.0] * count
    wanted = any(isinstance(light, DeltaLight) for light in scene.lights)
    index = torch.tensor(surface_of)
    for direction in rays.split(TILE):
        origin = direction.new_tensor(scene.camera.position).expand_as(direction)
        t, shape = nearest(scene.objects, origin, direction)
        rows = torch.nonzero(shape >= 0).squeeze(-1)
        point = origin[rows] + t[rows].unsqueeze(-1) * direction[rows]
        vertices = arrive(scene.objects, shape[rows], point, direction[rows])
        for number in range(count):
            front = (vertices.wo[:, 2] > 0) & (index[vertices.shape] == number)
            if bool(front.any()):
                lowest[number] = min(lowest[number], float(vertices.wo[front, 2].min()))
                if wanted:
                    found[number].append(vertices.take(torch.nonzero(front).squeeze(-1)))
    return [Seen(_together(parts) if parts else None, math.acos(low)) for parts, low in zip(found, lowest, strict=True)]


def _together(parts: list[Vertices]) -> Vertices:
    x, y, z = (torch.cat([part.axes[k] for part in parts]) for k in range(3))
    point, shape, wo = (torch.cat([getattr(part, name) for part in parts]) for name in ("point", "shape", "wo"))
    return Vertices(point, shape, (x, y, z), wo)


def lamps(scene: Scene) -> list[tuple[float, float]]:
    """The radiance of each light with an extent, and its largest irradiance on any object."""
    zero, found = torch.zeros((), dtype=torch.float64), []
    for light in scene.lights:
        if isinstance(light, AreaLight):
            radiance = float(light.colour(zero).detach().max())
            found.append((radiance, radiance * min(math.pi, _solid_angle(light, scene))))
    return found


def _solid_angle(light: AreaLight, scene: Scene) -> float:
    """The largest projected solid angle under which an object sees a light [sr], or more."""
    if isinstance(light, SphereLight):
        distance = min(shape.distance(light.center) for shape in scene.objects)
        return math.pi * light.radius**2 / distance**2 if distance > light.radius else math.inf
    if isinstance(light, RectangleLight):
        half = math.hypot(*light.edge_u, *light.edge_v) / 2
        distance = min(shape.distance(light.center) for shape in scene.objects) - half
        area = math.hypot(*light.edge_u) * math.hypot(*light.edge_v)
        return area / distance**2 if distance > 0 else math.inf
    return math.inf


def near(scene: Scene) -> bool:
    """Whether an object is so near to a rectangle that shines that points drawn on it are mostly the wrong ones."""
    return any(
        math.hypot(*light.edge_u) * math.hypot(*light.edge_v)
        > math.pi * max(min(shape.distance(light.center) for shape in scene.objects), 0.0) ** 2
        for light in scene.lights
        if isinstance(light, RectangleLight)
    )


def irradiance(scene: Scene) -> float:
    """The largest irradiance of the lights without extent on any object, together."""
    zero, total = torch.zeros((), dtype=torch.float64), 0.0
    for light in scene.lights:
        strength = float(light.colour(zero).detach().max())
        if isinstance(light, Directional):
            total += strength
        elif isinstance(light, PointLight):
            nearest_ = min(shape.distance(light.position) for shape in scene.objects)
            total += strength / nearest_**2 if nearest_ > 0 else math.inf
    return total


def largest_albedo(surface: AnySurface, farthest: float = GRAZING, tolerance: float = ROUGH / 10) -> float:
    """The largest albedo [1] over directions of view up to an angle from the normal, with the error claimed."""
    return _largest(_albedos(surface, farthest, tolerance))


def _largest(albedos: Tensor) -> float:
    """The largest of (ANGLES, ...), and what a parabola through three neighbours could hide between them."""
    bend = albedos.diff(dim=0).diff(dim=0).abs().amax() / 8 if len(albedos) > 2 else 0.0
    return float(albedos.max() + bend)


def _albedos(surface: AnySurface, farthest: float, tolerance: float) -> Tensor:
    """Albedos, (ANGLES, azimuths, C or 1)."""
    t = torch.linspace(0, 1, ANGLES, dtype=torch.float64)
    return surface.albedos(farthest * (1 - (1 - t).square()), tolerance)  # closer where albedos change more


def lost_albedo(whole: AnySurface, less: AnySurface, farthest: float, tolerance: float) -> float:
    """The largest albedo [1] that a surface loses by what `less` leaves out."""
    rest = _albedos(less, farthest, tolerance)
    return _largest((_albedos(whole, farthest, tolerance) - rest).abs()) + tolerance


def lost_highlight(
    scene: Scene, whole: AnySurface, less: AnySurface, where: Vertices | None, enough: float
) -> tuple[float, bool]:
    """The largest loss [radiance] under the lights without extent at visible points.

    The second is whether it is that of a few points only, where it is more than `enough` already.
    """
    if where is None:
        return 0.0, False
    lights = [light for light in scene.lights if isinstance(light, DeltaLight)]
    spread = torch.linspace(0, len(where) - 1, min(FIRST, len(where))).long()
    largest = _highlight(lights, whole, less, where.take(spread))
    if largest > enough or len(where) <= FIRST:
        return largest, len(where) > FIRST
    rows = torch.arange(len(where)).split(TILE)
    return max(_highlight(lights, whole, less, where.take(part)) for part in rows), False


def _highlight(lights: Sequence[DeltaLight], whole: AnySurface, less: AnySurface, where: Vertices) -> float:
    total = where.point.new_zeros(len(where), 1)
    with torch.no_grad():
        for light in lights:
            wi, _, strength = light.arriving(where.point)
            local = where.local(wi)
            lost = (whole.reflected(local, where.wo) - less.reflected(local, where.wo)).abs()
            total = total + lost * strength.unsqueeze(-1) * light.colour(strength)
    return float(total.max())
