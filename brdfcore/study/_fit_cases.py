"""The data of the study of fitting: the shipped linoleum, and more samples of a known material."""

from dataclasses import dataclass

import torch
from torch import Tensor

from ..demo import linoleum
from ..fitting import check
from ..fitting.losses import LOSSES
from ..fitting.problem import Problem
from ..formats.samples import Samples
from ..geometry import from_angles
from ..models.material import material

LINOLEUM = 222
TRUE = "lambert(kd=0.1) + ward_bounded(rs=0.2, ax=0.06, ay=0.18)"
NOISE = 0.05
_LOWEST = 0.02  # cosine of either direction


@dataclass(frozen=True)
class Case:
    """Samples, the model that is fitted to them, and the fit as numbers."""

    samples: Samples
    model: str
    problem: Problem


def case(size: int, seed: int) -> Case:
    """The linoleum for its 222 samples, else so many generated ones."""
    if size == LINOLEUM:
        samples, model = linoleum(), "lambert + ward_bounded(isotropic)"
    else:
        samples, model = generated(size, seed), "lambert + ward_bounded(anisotropic)"
    return Case(samples, model, Problem(check(1, model, azimuth_observed=True), samples, LOSSES["cosine"]))


def generated(size: int, seed: int, text: str = TRUE, noise: float = NOISE) -> Samples:
    """So many noisy samples [1/sr] of a known material: half uniform over the hemisphere, half drawn by it."""
    truth = material(text)
    generator = torch.Generator().manual_seed(seed)
    pairs: list[tuple[Tensor, Tensor]] = []
    found = 0
    while found < size:
        u = torch.rand(size, 8, dtype=torch.float64, generator=generator)
        wo, even = (
            from_angles(torch.acos(_LOWEST + (1 - _LOWEST) * u[:, k]), 2 * torch.pi * u[:, k + 1]) for k in (0, 2)
        )
        with torch.no_grad():
            wi = torch.where(u[:, 7:] < 0.5, even, truth.sample(wo, u[:, 4:7]))
        kept = wi[:, 2] > _LOWEST
        pairs.append((wi[kept], wo[kept]))
        found += int(kept.sum())
    wi, wo = (torch.cat(parts)[:size] for parts in zip(*pairs, strict=True))
    with torch.no_grad():
        f = truth.f(wi, wo)
    factor = 1 + noise * torch.randn(f.shape, dtype=torch.float64, generator=generator)
    return Samples(wi, wo, f * factor, azimuth_observed=True)


def start(problem: Problem, seed: int) -> Tensor:
    """A raw vector (D,) drawn from the search ranges."""
    u = torch.rand(problem.size, dtype=torch.float64, generator=torch.Generator().manual_seed(seed))
    drawn = torch.empty_like(u)
    for key, at in problem.slices.items():
        parameter = problem.plan.form.parameters[key]
        low, high = parameter.to_raw(torch.tensor(parameter.search_range, dtype=torch.float64))
        drawn[at] = low + (high - low) * u[at]
    return drawn
