"""Rendering in passes over tiles: each pass adds samples to every pixel, until there are enough or the noise is low."""

import math
import time
from collections.abc import Callable, Iterator

import torch
from torch import Tensor

from ..errors import InvalidValueError
from . import _checks
from .effects import Plan
from .image import Image
from .integrators import Integrator
from .plan import plan as make_plan
from .scene import Scene

TILE = 2**16  # paths at a time, for the memory
PASS = 16  # samples of a ray before the noise is looked at


def render(
    scene: Scene,
    plan: Plan | None = None,
    *,
    tolerance: float = 1e-3,
    seed: int = 0,
    device: torch.device | str = "cpu",
    gradient: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Image:
    """The image of a scene, under a plan or the one that the tolerance [radiance] makes.

    Every ray gets the scene's samples shared over a pixel's rays, at least two, or fewer where its noise is met. The
    same seed, device and tile size give the same image; where the plan calls for no sample, no random number is drawn.
    gradient   keep the graph, to differentiate the pixels by the materials' parameters and by lights' strengths that
               are tensors; what the plan has off has no derivative. Pass `everything(scene)` to have all.
    progress   is called with the share that is done, from 0 to 1
    Raises InvalidValueError for a plan of another scene, a seed that is no whole number from 0, and a device that is
    not there.
    """
    place = _checks.device(device)
    _checks.whole("seed", seed, 0, 2**63 - 1)
    start = time.perf_counter()
    chosen = make_plan(scene, tolerance) if plan is None else plan
    if chosen.scene is not scene:
        raise InvalidValueError(
            "Expected plan to be of this scene, got one of another. Plan this one, or leave the plan out.", field="plan"
        )
    with torch.set_grad_enabled(gradient):
        mean, variance, samples = _passes(chosen, seed, place, progress or (lambda share: None))
    height, width, n2 = scene.camera.height, scene.camera.width, scene.camera.grid**2
    pixels = mean.reshape(height, width, n2, -1).mean(2).expand(height, width, 3)
    noise = torch.sqrt(variance.reshape(height, width, n2, -1).sum(2)) / n2
    return Image(pixels, noise.expand(height, width, 3), chosen, samples, time.perf_counter() - start)


def _passes(
    plan: Plan, seed: int, device: torch.device, progress: Callable[[float], None]
) -> tuple[Tensor, Tensor, int]:
    """The radiance of each ray (N, C), its variance, and the samples that were taken."""
    scene, integrator = plan.scene, Integrator(plan)
    rays = scene.camera.rays(device).reshape(-1, 3)
    exact = torch.cat([_exact(integrator, direction) for direction in rays.split(TILE)])
    if not integrator.random:
        progress(1.0)
        return exact, torch.zeros_like(exact), 0
    generator = torch.Generator(device=device).manual_seed(seed)
    wanted, taken = max(2, math.ceil(scene.samples / scene.camera.grid**2)), 0
    total, squares = torch.zeros_like(exact), torch.zeros_like(exact)
    while taken < wanted:
        most = max(PASS, TILE // len(rays))
        count = min(max(PASS, taken), most, wanted - taken)  # doubled, as long as all rays fit a tile
        parts, tiles = [], math.ceil(len(rays) / max(1, TILE // count))
        for part in _tiles(integrator, rays, count, generator):
            parts.append(part)
            progress((taken + count * len(parts) / tiles) / wanted)
        total = total + torch.cat([part[0] for part in parts])
        squares = squares + torch.cat([part[1] for part in parts])
        taken += count
        with torch.no_grad():
            mean = total / taken
            variance = (
                (squares / taken - mean.square()).clamp(min=0) / (taken - 1) if taken > 1 else torch.inf * squares
            )
            if scene.noise is not None and taken > 1 and _noise(variance, scene) <= scene.noise:
                progress(1.0)
                break
    return exact + total / taken, variance, taken


def _noise(variance: Tensor, scene: Scene) -> float:
    """The root mean square of the pixels' standard errors."""
    n2 = scene.camera.grid**2
    return math.sqrt(float(variance.mean()) / n2)


def _exact(integrator: Integrator, direction: Tensor) -> Tensor:
    """What rays (N, 3) see without a random number."""
    origin = direction.new_tensor(integrator.plan.scene.camera.position).expand_as(direction)
    emitted, vertices, rows = integrator.seen(origin, direction)
    if not len(rows):
        return emitted
    return emitted.index_add(0, rows, integrator.exact(vertices).expand(len(rows), emitted.shape[-1]))


def _tiles(
    integrator: Integrator, rays: Tensor, count: int, generator: torch.Generator
) -> Iterator[tuple[Tensor, Tensor]]:
    """The sums of `count` samples and of their squares, tile after tile."""

    def uniform(rows: int, columns: int) -> Tensor:
        return torch.rand(rows, columns, generator=generator, dtype=rays.dtype, device=rays.device)

    for direction in rays.split(max(1, TILE // count)):
        origin = direction.new_tensor(integrator.plan.scene.camera.position).expand_as(direction)
        emitted, vertices, rows = integrator.seen(origin, direction)
        sums, squares = torch.zeros_like(emitted), torch.zeros_like(emitted)
        if len(rows):
            which = torch.arange(len(rows), device=rays.device).repeat_interleave(count)
            values = integrator.estimate(vertices.take(which), uniform).reshape(len(rows), count, -1)
            sums = sums.index_add(0, rows, values.sum(1))
            squares = squares.index_add(0, rows, values.detach().square().sum(1))
        yield sums, squares
