"""What the shared model tests are run over: every model with every choice of options, drawn values, hard directions."""

import itertools
from typing import Any

import numpy as np
import pytest
import torch

import brdfcore as bc
from brdfcore.hard_cases import covering
from brdfcore.hard_cases.catalogue import form_of
from brdfcore.parameters import Parameter


def name_of(choice: bc.Model) -> str:
    """A test's id."""
    return f"{choice.name}({','.join(choice.options)})"


CHOICES = [choice for model in bc.MODELS.values() for choice in model.choices()]
CHOICE_IDS = [name_of(choice) for choice in CHOICES]
COVERING = [choice for model in bc.MODELS.values() for choice in covering(model)]
# every choice at the full tier; by default enough of them that each word of each model is tested
EVERY_CHOICE = [choice if choice in COVERING else pytest.param(choice, marks=pytest.mark.full) for choice in CHOICES]
DTYPES = (torch.float32, torch.float64)


def counted(few: int, many: int) -> list[Any]:
    """(choice, count) for tests that cost much a case: `few` for the covering choices, `many` for all at full."""
    by_default = [pytest.param(choice, few, id=name_of(choice)) for choice in COVERING]
    in_full = [pytest.param(choice, many, id=f"{name_of(choice)}-full", marks=pytest.mark.full) for choice in CHOICES]
    return by_default + in_full


# One table of tolerances, per dtype.
EPS = {torch.float32: 2.0**-23, torch.float64: 2.0**-52}
# Two ways round the same arithmetic (reciprocity, channels, devices): a few roundings.
SAME = 32


def material_of(choice: bc.Model, values: dict[str, object] | None = None) -> bc.Material:
    """A material of this one term, with values by parameter name."""
    given = {f"{choice.name}.{name}": value for name, value in (values or {}).items()}
    return bc.Material(form_of(choice), given)


def draw_value(parameter: Parameter, rng: np.random.Generator, *, where: str) -> float:
    """A value from a parameter's box ("box"), its search range ("search"), or near its default ("mild")."""
    low, high = (parameter.low, parameter.high) if where == "box" else parameter.search_range
    if where == "mild" and parameter.scale == "log":
        low, high = max(low, parameter.default / 3), min(high, parameter.default * 5)
    elif where == "mild":
        low, high = low + 0.05 * (high - low), high - 0.05 * (high - low)
    if parameter.scale == "log":
        return float(np.clip(np.exp(rng.uniform(np.log(low), np.log(high))), parameter.low, parameter.high))
    return float(rng.uniform(low, high))


def draw_values(
    choice: bc.Model, rng: np.random.Generator, *, where: str = "search", channels: int = 0
) -> dict[str, object]:
    """Values for every parameter; those that may have colour have `channels` of them unless that is 0."""
    return {
        p.name: [draw_value(p, rng, where=where) for _ in range(channels)]
        if channels and p.per_channel != "no"
        else draw_value(p, rng, where=where)
        for p in choice.parameters
    }


def corners(choice: bc.Model, *, shapes_only: bool = False) -> list[dict[str, float]]:
    """Every corner of the model's box, or of its shapes', which alone move samples, with the rest at their defaults.

    An open end is represented by the next number inside.
    """
    ends = []
    for p in choice.parameters:
        if shapes_only and p.per_channel != "no":
            ends.append((p.default,))
            continue
        low = np.nextafter(p.low, np.inf) if p.open_low else p.low
        high = np.nextafter(p.high, -np.inf) if p.open_high else p.high
        ends.append((float(low), float(high)))
    return [dict(zip((p.name for p in choice.parameters), corner, strict=True)) for corner in itertools.product(*ends)]


def ends(choice: bc.Model) -> list[dict[str, float]]:
    """All values at their lowest, and all at their highest: where each parameter is on its own, no other corner is."""
    every = corners(choice)
    return [every[0], every[-1]]


def hemisphere(rng: np.random.Generator, count: int, dtype: torch.dtype = torch.float64) -> torch.Tensor:
    """Unit vectors uniform on the upper hemisphere, (count, 3)."""
    z, phi = rng.uniform(0, 1, count), rng.uniform(0, 2 * np.pi, count)
    r = np.sqrt(1 - z * z)
    return torch.tensor(np.stack([r * np.cos(phi), r * np.sin(phi), z], -1)).to(dtype)


def lobe_pairs(
    material: bc.Material, rng: np.random.Generator, count: int, dtype: torch.dtype = torch.float64
) -> tuple[torch.Tensor, torch.Tensor]:
    """Pairs (wi, wo), each (n, 3), both above the horizon, with wi where the material reflects: at most count."""
    wo = hemisphere(rng, 4 * count)
    wi = material.sample(wo, torch.tensor(rng.uniform(0, 1, (4 * count, 3)))).detach()
    keep = (wi[:, 2] > 1e-6) & (wo[:, 2] > 1e-6)
    return wi[keep][:count].to(dtype), wo[keep][:count].to(dtype)


def _raised(height: float, azimuth: float) -> list[float]:
    side = np.sqrt(max(1 - height * height, 0.0))
    return [side * np.cos(azimuth), side * np.sin(azimuth), height]


def above_horizon(dtype: torch.dtype) -> tuple[torch.Tensor, torch.Tensor]:
    """Hard pairs (wi, wo) whose directions are all strictly above the horizon."""
    heights = [1e-12, 2e-12, 1e-8, 1e-4, 1e-2, 0.5, 1 - 1e-9, 1.0]
    azimuths = [0.0, 1e-12, 1e-6, 0.7, np.pi / 2, np.pi - 1e-6, np.pi]
    pairs = [(_raised(a, 0.3), _raised(b, 0.3 + t)) for a, b, t in itertools.product(heights, heights, azimuths)]
    # Half vector exactly the normal: the horizontal components cancel to the last bit.
    mirrors = [(_raised(h, t), _raised(h, t)) for h in heights for t in (0.0, 0.4, np.pi / 2, 2.9)]
    pairs += [(w, [-v[0], -v[1], v[2]]) for w, v in mirrors]
    pairs += [(w, w) for w, _ in mirrors]
    tiny = torch.finfo(dtype).tiny
    smallest = [float(torch.nextafter(torch.zeros((), dtype=dtype), torch.ones((), dtype=dtype))), tiny / 8, tiny]
    for height, side in itertools.product(smallest, (1.0, -1.0)):
        pairs += [([1.0, 0.0, height], [side, 0.0, other]) for other in (*smallest, 1e-12)]
        pairs += [([0.6, 0.8, height], [side * 0.6, side * 0.8, height]), ([0.0, 1.0, height], [0.0, 0.0, 1.0])]
    pairs += [([0.0, 0.0, 1 + 1e-7], [0.0, 0.0, 1.0]), ([0.0, 0.0, 1.0], [3e-8, 0.0, 1.0])]
    wi, wo = (torch.tensor([pair[k] for pair in pairs], dtype=torch.float64).to(dtype) for k in (0, 1))
    assert bool(((wi[:, 2] > 0) & (wo[:, 2] > 0)).all())
    return wi, wo


def not_above_horizon(dtype: torch.dtype) -> tuple[torch.Tensor, torch.Tensor]:
    """Hard pairs of which at least one direction is at or below the horizon."""
    low = [
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, -0.0],
        [0.6, -0.8, 0.0],
        [1.0, 0.0, -1e-12],
        [0.6, 0.0, -0.8],
        [0.0, 0.0, -1.0],
        [0.0, 0.0, 0.0],
        [0.0, 1.0, -torch.finfo(dtype).tiny / 4],
    ]
    high = [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [1.0, 0.0, 1e-12], [-1.0, 0.0, 1e-12], [0.0, 1.0, 1e-30]]
    pairs = [*itertools.product(low, low), *itertools.product(low, high), *itertools.product(high, low)]
    wi, wo = (torch.tensor([pair[k] for pair in pairs], dtype=torch.float64).to(dtype) for k in (0, 1))
    return wi, wo
