"""How light is summed: in closed form, by samples of lights, by samples of the materials, or by both.

    L(wo) = sum over lights without extent of f cos theta_i E  +  integral of f(wi, wo) cos theta_i L(wi) dwi

Light samples and material samples are combined by multiple importance sampling with the power heuristic (Veach 1997,
eq. 9.14, exponent 2), where the plan has both on. Paths go on along the material's samples to the planned depth. What
the plan has off is not called.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from ..energy import of_form
from ..energy.tables import albedo_table
from .effects import BRDF_SAMPLING, CLOSED_FORM, LIGHT_SAMPLING, LOOK_UP, SHADOWS, Plan
from .lights import AreaLight, DeltaLight, Dome
from .surfaces import Surface
from .trace import NEARER, Vertices, arrive, blocked, grouped, nearest

MANY = 1000  # albedos from which on a table is cheaper than a quadrature for each
TABLE = (1e-8, 1e-2)  # tolerances that a table may be asked for

Uniform = Callable[[int, int], Tensor]  # (N, K) numbers in [0, 1)


@dataclass(frozen=True, eq=False)
class Integrator:
    """A scene under a plan."""

    plan: Plan

    @cached_property
    def _surface_of(self) -> Tensor:
        return torch.tensor(self.plan.surface_of)

    @cached_property
    def _delta(self) -> list[DeltaLight]:
        on = self.plan.on(CLOSED_FORM)
        return [light for light in self.plan.scene.lights if on and isinstance(light, DeltaLight)]

    @cached_property
    def _area(self) -> list[AreaLight]:
        """The lights with an extent."""
        return [light for light in self.plan.scene.lights if isinstance(light, AreaLight)]

    @cached_property
    def _sampled(self) -> list[AreaLight]:
        """Those of them that are sampled."""
        looked_up = self.plan.on(LOOK_UP)
        return [light for light in self._area if not (looked_up and isinstance(light, Dome))]

    @property
    def random(self) -> bool:
        """Whether anything takes random numbers."""
        return bool(self._sampled) or self.plan.depth > 0

    def seen(self, origin: Tensor, direction: Tensor) -> tuple[Tensor, Vertices, Tensor]:
        """The lights that rays (N, 3) see themselves, (N, C), what they meet first, and the rows of those that do."""
        shapes = self.plan.scene.objects
        t, shape = nearest(shapes, origin, direction)
        emitted = origin.new_zeros(len(origin), self.plan.scene.channels)
        for light in self._area:
            reached = light.seen(origin, direction) * NEARER < t
            emitted = emitted + reached.unsqueeze(-1) * light.colour(origin)
        rows = torch.nonzero(shape >= 0).squeeze(-1)
        origin, direction, t, shape = origin[rows], direction[rows], t[rows], shape[rows]
        vertices = arrive(shapes, shape, origin + t.unsqueeze(-1) * direction, direction)
        front = torch.nonzero(vertices.wo[:, 2] > 0).squeeze(-1)
        return emitted, vertices.take(front), rows[front]

    def exact(self, vertices: Vertices) -> Tensor:
        """What needs no random number, (N, C): lights without extent, and the albedo under an open sky."""
        total = self._closed_form(vertices)
        if self.plan.on(LOOK_UP):
            sky = [light.colour(vertices.point) for light in self._area if isinstance(light, Dome)]
            for radiance in sky:
                total = total + radiance * self._albedo(vertices)
        return total

    def estimate(self, vertices: Vertices, uniform: Uniform) -> Tensor:
        """One sample for each vertex of what `exact` leaves, (N, C)."""
        scene, depth = self.plan.scene, self.plan.depth
        by_light, by_material = self.plan.on(LIGHT_SAMPLING), self.plan.on(BRDF_SAMPLING)
        shadows, total = self.plan.on(SHADOWS), vertices.point.new_zeros(len(vertices), scene.channels)
        path, weight = torch.arange(len(vertices), device=total.device), total.new_ones(len(vertices), 1)
        for bounce in range(depth + 1):
            if not len(vertices):
                break
            gathered = (
                self._closed_form(vertices) if bounce and self._delta else vertices.point.new_zeros(len(vertices), 1)
            )
            if by_light:
                gathered = gathered + self._light_samples(vertices, uniform)
            if by_material or bounce < depth:
                wi = self._drawn(vertices, uniform(len(vertices), 3))
                density = self._pdf(vertices, wi)
                reflected = self._reflected(vertices, wi)
                empty = (density == 0).unsqueeze(-1)
                ratio = torch.where(empty, 0.0, reflected / torch.where(empty, 1.0, density.unsqueeze(-1)))
                towards = vertices.world(wi)
                t, shape = None, None
                if shadows or bounce < depth:
                    t, shape = nearest(scene.objects, vertices.point, towards, vertices.shape)
                if by_material:
                    limit = t if shadows and t is not None else torch.full_like(density, torch.inf)
                    for light in self._sampled:
                        distance, other = light.met(vertices.point, vertices.normal, towards)
                        share = (distance * NEARER < limit).to(density.dtype)
                        if by_light:
                            share = share * power_heuristic(density, other)
                        gathered = gathered + ratio * share.unsqueeze(-1) * light.colour(density)
            total = total.index_add(0, path, (weight * gathered).expand(len(path), scene.channels))
            if bounce < depth:
                assert t is not None and shape is not None  # noqa: S101, PT018 - for mypy: a further bounce traces
                goes = torch.nonzero((shape >= 0) & (ratio.detach() != 0).any(-1)).squeeze(-1)
                path, weight = path[goes], (weight * ratio)[goes]
                point = vertices.point[goes] + t[goes].unsqueeze(-1) * towards[goes]
                vertices = arrive(scene.objects, shape[goes], point, towards[goes])
        return total

    def _closed_form(self, vertices: Vertices) -> Tensor:
        total = vertices.point.new_zeros(len(vertices), self.plan.scene.channels)
        for light in self._delta:
            wi, distance, strength = light.arriving(vertices.point)
            if self.plan.on(SHADOWS):
                strength = torch.where(blocked(self.plan.scene.objects, vertices, wi, distance), 0.0, strength)
            reflected = self._reflected(vertices, vertices.local(wi))
            total = total + reflected * strength.unsqueeze(-1) * light.colour(strength)
        return total

    def _light_samples(self, vertices: Vertices, uniform: Uniform) -> Tensor:
        total = vertices.point.new_zeros(len(vertices), self.plan.scene.channels)
        for light in self._sampled:
            wi, distance, density = light.sample(vertices.point, vertices.normal, uniform(len(vertices), 2))
            local = vertices.local(wi)
            share = (density > 0).to(density.dtype) / torch.where(density > 0, density, 1.0)
            if self.plan.on(SHADOWS):
                share = torch.where(blocked(self.plan.scene.objects, vertices, wi, distance), 0.0, share)
            if self.plan.on(BRDF_SAMPLING):
                share = share * power_heuristic(density, self._pdf(vertices, local))
            total = total + self._reflected(vertices, local) * share.unsqueeze(-1) * light.colour(density)
        return total

    def _albedo(self, vertices: Vertices) -> Tensor:
        """The directional albedo at each vertex, (N, C), differentiable where gradients are asked for."""
        (surface,) = self.plan.surfaces
        assert isinstance(surface, Surface)  # noqa: S101 - the plan looks nothing up for a table
        cosine = vertices.wo[:, 2].clamp(max=1)
        azimuth = torch.atan2(vertices.wo[:, 1], vertices.wo[:, 0])
        if surface.black or not len(vertices):
            return torch.zeros_like(vertices.point[:, :1])
        if torch.is_grad_enabled() or len(vertices) < MANY:
            return of_form(surface.form, surface.values(cosine), cosine, azimuth, self.plan.albedo_tolerance).values
        theta = torch.acos(cosine)
        tolerance = min(max(self.plan.albedo_tolerance, TABLE[0]), TABLE[1])
        ends = (0.0, min(float(theta.max()) + 1e-6, torch.pi / 2))
        table = albedo_table(surface.frozen(), {"theta": ends}, tolerance, cache=None)
        return table(theta, azimuth).to(cosine)

    def _reflected(self, vertices: Vertices, wi: Tensor) -> Tensor:
        return self._grouped(lambda surface, *rows: surface.reflected(*rows), vertices, wi, vertices.wo)

    def _pdf(self, vertices: Vertices, wi: Tensor) -> Tensor:
        return self._grouped(lambda surface, *rows: surface.pdf(*rows), vertices, wi, vertices.wo)

    def _drawn(self, vertices: Vertices, u: Tensor) -> Tensor:
        return self._grouped(lambda surface, *rows: surface.sample(*rows), vertices, vertices.wo, u)

    def _grouped(self, compute: Callable[..., Tensor], vertices: Vertices, *tensors: Tensor) -> Tensor:
        surfaces = self.plan.surfaces
        index = self._surface_of.to(vertices.shape.device)[vertices.shape] if len(surfaces) > 1 else vertices.shape
        return grouped(index, len(surfaces), lambda number, *rows: compute(surfaces[number], *rows), *tensors)


def power_heuristic(own: Tensor, other: Tensor) -> Tensor:
    """The share own^2 / (own^2 + other^2) [1] of a sample of density `own`, which is 0 where that is."""
    return torch.where(own > 0, 1 / (1 + (other / torch.where(own > 0, own, 1.0)).square()), 0.0)
