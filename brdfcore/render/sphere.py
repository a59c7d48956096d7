"""A lit sphere, the quickest look at a material: one lamp at the viewer's left shoulder, another behind on the right.

Both are without extent and the sphere is alone, so that each pixel is f cos theta_i E for each lamp, in closed form.
The second lamp grazes the sphere where its light leaves towards the viewer, which is where models differ most.
"""

import math

import torch
from torch import Tensor

from ..models.material import Material
from .camera import Camera
from .lights import Directional
from .shapes import Sphere
from .trace import Vertices, arrive

LAMPS = (
    Directional(direction=(1.0, -0.8, 0.9), irradiance=0.9 * math.pi),  # a white diffuser that faces it shows 0.9
    Directional(direction=(-0.7, 1.0, 0.35), irradiance=0.6 * math.pi),
)
DISTANCE, FOV = 6.0, 19.0  # the sphere reaches just beyond the circle that touches the image's edges


def lit_sphere(material: Material, size: int = 160) -> Tensor:
    """The radiance (size, size, C) of a sphere of a material, of any number of channels, differentiable; 0 beside it.

    The material's x axis points up along the meridians.
    """
    camera = Camera(position=(DISTANCE, 0.0, 0.0), look_at=(0.0, 0.0, 0.0), width=size, height=size, fov_deg=FOV)
    ball = Sphere(center=(0.0, 0.0, 0.0), radius=1.0, material=material)
    rays = camera.rays().reshape(-1, 3)
    origin = rays.new_tensor(camera.position).expand_as(rays)
    distance = ball.hit(origin, rays)
    rows = torch.nonzero(torch.isfinite(distance)).squeeze(-1)
    point = origin[rows] + distance[rows].unsqueeze(-1) * rays[rows]
    vertices = arrive((ball,), torch.zeros_like(rows), point, rays[rows])
    radiance = sum((_reflected(material, vertices, lamp) for lamp in LAMPS), torch.zeros(()))
    image = radiance.new_zeros(len(rays), radiance.shape[-1])
    return image.index_add(0, rows, radiance).reshape(size, size, -1)


def _reflected(material: Material, vertices: Vertices, lamp: Directional) -> Tensor:
    wi, _, _ = lamp.arriving(vertices.point)
    local = vertices.local(wi)
    return material.f(local, vertices.wo) * local[:, 2:].clamp(min=0) * lamp.colour(local)
