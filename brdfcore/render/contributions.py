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

from ..energy import of_form
from ..energy.probe import symmetry
from .lights import AreaLight, DeltaLight, Directional, RectangleLight, SphereLight
from .lights import Point as PointLight
from .scene import Scene
from .surfaces import Surface
from .trace import Vertices, arrive, nearest

ANGLES, AZIMUTHS = 17, 5  # at which albedos are looked at; they change slowly
GRAZING = math.radians(89.99)
FIRST = 256  # points at which a part is looked at first: one that shows there is not looked at elsewhere
FLATTEST = 28 / (23 * math.pi)  # the largest f [1/sr] of a diffuse term of reflectance 1: Ashikhmin and Shirley's
DIFFUSE = ("lambert", "coupled_lambert", "ashikhmin_shirley_diffuse")
TILE = 2**16
ROUGH = 1e-2  # tolerance of albedos where two digits are enough


@dataclass(frozen=True, eq=False)
class Seen:
    """What the camera sees of one material."""

    vertices: Vertices
    farthest: float  # from the normal, of the directions of view [rad]


def seen(scene: Scene, surface_of: Sequence[int], count: int) -> list[Seen]:
    """The visible points of each material, one for each ray of the camera."""
    rays = scene.camera.rays().reshape(-1, 3)
    found: list[list[Vertices]] = [[] for _ in range(count)]
    index = torch.tensor(surface_of)
    for direction in rays.split(TILE):
        origin = direction.new_tensor(scene.camera.position).expand_as(direction)
        t, shape = nearest(scene.objects, origin, direction)
        rows = torch.nonzero(shape >= 0).squeeze(-1)
        point = origin[rows] + t[rows].unsqueeze(-1) * direction[rows]
        vertices = arrive(scene.objects, shape[rows], point, direction[rows])
        for number in range(count):
            front = (vertices.wo[:, 2] > 0) & (index[vertices.shape] == number)
            found[number].append(vertices.take(torch.nonzero(front).squeeze(-1)))
    return [_together(parts) for parts in found]


def _together(parts: list[Vertices]) -> Seen:
    x, y, z = (torch.cat([part.axes[k] for part in parts]) for k in range(3))
    wo = torch.cat([part.wo for part in parts])
    vertices = Vertices(
        torch.cat([part.point for part in parts]), torch.cat([part.shape for part in parts]), (x, y, z), wo
    )
    lowest = float(wo[:, 2].min().clamp(max=1)) if len(wo) else 1.0
    return Seen(vertices, math.acos(lowest))


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


def largest_albedo(surface: Surface, farthest: float = GRAZING, tolerance: float = ROUGH / 10) -> float:
    """The largest albedo [1] over directions of view up to an angle from the normal, with the error claimed."""
    return _largest(_albedos(surface, farthest, tolerance))


def _largest(albedos: Tensor) -> float:
    """The largest of (ANGLES, ...), and what a parabola through three neighbours could hide between them."""
    bend = albedos.diff(dim=0).diff(dim=0).abs().amax() / 8 if len(albedos) > 2 else 0.0
    return float(albedos.max() + bend)


def _albedos(surface: Surface, farthest: float, tolerance: float) -> Tensor:
    """Albedos, (ANGLES, AZIMUTHS or 1, C or 1)."""
    if surface.black:
        return torch.zeros(1, 1, 1, dtype=torch.float64)
    t = torch.linspace(0, 1, ANGLES, dtype=torch.float64)
    theta = farthest * (1 - (1 - t).square())  # closer where albedos change more
    with torch.no_grad():
        values = surface.values(theta)
        azimuths = 1 if symmetry(surface.form, values).isotropic else AZIMUTHS
        phi = torch.linspace(0, torch.pi / 2, azimuths, dtype=torch.float64)
        found = of_form(surface.form, values, torch.cos(theta)[:, None], phi, tolerance)
    return found.values + found.error.nan_to_num(posinf=0.0)


def lost_albedo(whole: Surface, less: Surface, farthest: float, tolerance: float) -> float:
    """The largest albedo [1] that a surface loses by what `less` leaves out."""
    rest = _albedos(less, farthest, tolerance)
    return _largest((_albedos(whole, farthest, tolerance) - rest).abs()) + tolerance


def lost_highlight(scene: Scene, whole: Surface, less: Surface, where: Vertices, enough: float) -> float:
    """The largest loss [radiance] under the lights without extent at visible points, or at least `enough`."""
    lights = [light for light in scene.lights if isinstance(light, DeltaLight)]
    if not lights or not len(where):
        return 0.0
    spread = torch.linspace(0, len(where) - 1, min(FIRST, len(where))).long()
    largest = _highlight(lights, whole, less, where.take(spread))
    if largest > enough or len(where) <= FIRST:
        return largest
    rows = torch.arange(len(where)).split(TILE)
    return max(_highlight(lights, whole, less, where.take(part)) for part in rows)


def _highlight(lights: Sequence[DeltaLight], whole: Surface, less: Surface, where: Vertices) -> float:
    total = where.point.new_zeros(len(where), 1)
    with torch.no_grad():
        for light in lights:
            wi, _, strength = light.arriving(where.point)
            local = where.local(wi)
            lost = (whole.reflected(local, where.wo) - less.reflected(local, where.wo)).abs()
            total = total + lost * strength.unsqueeze(-1) * light.colour(strength)
    return float(total.max())


def diffuse_peak(surface: Surface) -> float:
    """The largest f cos theta_i [1/sr] over all directions of a surface of diffuse terms; inf where it has a lobe."""
    values = surface.values(torch.zeros((), dtype=torch.float64))
    total = 0.0
    for term in surface.form.terms:
        coefficients = term.model.coefficients(surface.form.of_term(term, values))
        largest = max(float(c.detach().max()) for c in coefficients)
        if largest == 0:
            continue
        if term.model.name not in DIFFUSE:
            return math.inf
        total += FLATTEST * largest
    return total
