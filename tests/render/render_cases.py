"""Scenes that the tests of rendering share."""

import math

import numpy as np
import torch

import brdfcore as bc
from brdfcore.render import (
    Camera,
    Directional,
    Dome,
    Plane,
    Point,
    Rectangle,
    RectangleLight,
    Scene,
    Sphere,
    SphereLight,
)
from brdfcore.render.integrators import Integrator

BALL = {"center": (0.0, 0.0, 0.0), "radius": 1.0}


def camera(size: int = 12, position=(4.0, 0.5, 0.7), look_at=(0.0, 0.0, 0.0), **more) -> Camera:
    return Camera(position=position, look_at=look_at, width=size, height=size, **more)


def lone_sphere(material, lights, size: int = 12, samples: int = 64, **more) -> Scene:
    return Scene(
        camera=camera(size), objects=[Sphere(material=material, **BALL, **more)], lights=lights, samples=samples
    )


def visible(scene: Scene):
    """The rows of the pixels that show an object, and the directions of view there in its frame."""
    rays = scene.camera.rays().reshape(-1, 3)
    origin = rays.new_tensor(scene.camera.position).expand_as(rays)
    _, vertices, rows = Integrator(bc.render.plan(scene, 1.0)).seen(origin, rays)
    return rows, vertices


def albedos(scene: Scene, tolerance: float = 1e-7) -> tuple[torch.Tensor, torch.Tensor]:
    """The rows of the pixels that show a lone object, and the quadrature's albedo there, (N, C)."""
    rows, vertices = visible(scene)
    theta = torch.acos(vertices.wo[:, 2].clamp(max=1))
    azimuth = torch.atan2(vertices.wo[:, 1], vertices.wo[:, 0])
    return rows, bc.albedo(scene.objects[0].material, theta, azimuth, tolerance).values.detach()


def sidak(cases: int, level: float = 1e-3) -> float:
    """How many standard errors the largest of so many normal deviates stays within at this level, two-sided."""
    each = 1 - (1 - level) ** (1 / cases)
    return float(torch.special.ndtri(torch.tensor(1 - each / 2, dtype=torch.float64)))


MATERIALS = (
    "lambert(kd={kd})",
    "lambert(kd={kd}) + ward_bounded(isotropic, rs={ks}, a={a})",
    "lambert(kd={kd}) + ggx(isotropic, schlick, ks={ks}, f0={f0}, a={a})",
    "lambert(kd={kd}) + ashikhmin_shirley(isotropic, scaled, ks={ks}, f0={f0}, n=20)",
    "ward_bounded(anisotropic, rs={ks}, ax={a}, ay={b})",
    "coupled_lambert(kd={kd}, f0=kurt_plausible.f0) + kurt_plausible(isotropic, schlick, ks={ks}, f0={f0}, m={a})",
)


def random_scene(seed: int, size: int = 8, samples: int = 64) -> Scene:
    """One to three shapes with drawn materials, some of whose parts are faint, under one or two drawn lights."""
    rng = np.random.default_rng(seed)

    def text() -> str:
        number = {
            "kd": rng.choice([0.0, 1e-4, 0.2, 0.5]),
            "ks": rng.choice([0.0, 1e-4, 0.2, 0.4]),
            "f0": rng.choice([0.05, 0.5, 1.0]),
            "a": rng.uniform(0.15, 0.5),
            "b": rng.uniform(0.15, 0.5),
        }
        return str(rng.choice(MATERIALS)).format(**{name: round(float(x), 6) for name, x in number.items()})

    objects: list = [Sphere(material=text(), center=(0.0, 0.0, 1.0), radius=1.0)]
    count = int(rng.integers(1, 4))
    if count > 1:
        objects.append(Plane(material=text()))
    if count > 2:
        objects.append(
            Rectangle(material=text(), center=(-1.5, 0.0, 1.0), edge_u=(0.0, 3.0, 0.0), edge_v=(0.0, 0.0, 3.0))
        )
    turn = rng.uniform(0, 2 * math.pi)
    kinds = [
        Dome(radiance=1.0),
        Directional(direction=(math.cos(turn), math.sin(turn), 1.5), irradiance=[1.0, 0.8, 0.6]),
        Point(position=(2.0, 2.0, 3.0), intensity=8.0),
        RectangleLight(center=(0.0, 0.0, 5.0), edge_u=(0.0, 2.0, 0.0), edge_v=(2.0, 0.0, 0.0), radiance=3.0),
        SphereLight(center=(2.0, -2.0, 3.0), radius=0.7, radiance=3.0),
    ]
    chosen = rng.choice(len(kinds), int(rng.integers(1, 3)), replace=False)
    view = Camera(position=(6.0, 1.0, 2.5), look_at=(0.0, 0.0, 0.8), width=size, height=size, fov_deg=35)
    return Scene(camera=view, objects=objects, lights=[kinds[k] for k in chosen], samples=samples)
