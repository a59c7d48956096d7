"""Which terms of the materials, and which of their options, an image needs: each with the bound of its absence."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import torch

from ..models.base import Model
from ..parameters import Values
from . import contributions
from .effects import Effect
from .scene import Scene
from .surfaces import Surface, replaceable, widths

OPTION_NAMES = {"anisotropic": "anisotropy", "schlick": "fresnel", "scaled": "fresnel", "compensated": "compensation"}


@dataclass(frozen=True, eq=False)
class Lighting:
    """What the bounds rest on."""

    even: float  # radiance of the lights with extent
    irradiance: float  # of those without
    albedo: float  # the largest of the scene
    direct: float  # D [radiance]
    in_mean: bool  # whether D is a mean only


def decide(
    scene: Scene,
    surfaces: list[Surface],
    surface_of: tuple[int, ...],
    light: Lighting,
    depth: int,
    budget: float,
    forced: Mapping[str, bool],
) -> tuple[list[Effect], list[Surface]]:
    """The terms and their options, each with its bound, and the surfaces without those that are left out."""
    visible = contributions.seen(scene, surface_of, len(surfaces))
    rows: list[tuple[Effect, int, str, str | None]] = []
    for number, surface in enumerate(surfaces):
        owner = _name(scene, surface_of.index(number))
        values = surface.values(torch.zeros((), dtype=torch.float64))
        for term in surface.form.terms:
            own = surface.form.of_term(term, values)
            alone = replace(surface, dropped=frozenset(t.label for t in surface.form.terms if t is not term))
            name = f"{owner}: {term.label}"
            if _is_zero(term.model, own):
                bound, reason = 0.0, "its reflectance is 0"
            else:
                nothing = replace(alone, dropped=frozenset(t.label for t in surface.form.terms))
                bound = _bound(scene, alone, nothing, visible[number], light, depth, budget)
                reason = "its largest contribution"
            rows.append((Effect(name, True, reason, 0.0, bound), number, term.label, None))
            for word in replaceable(term.model):
                simpler = replace(alone, simpler={term.label: frozenset({word})})
                if bound == 0:
                    found, why = 0.0, "its term is off"
                elif word == "anisotropic":
                    pair = widths(term.model, own)
                    if pair is None:
                        continue
                    equal = bool((pair[0] == pair[1]).all())
                    found, why = (0.0, "equal widths") if equal else (bound, "unequal widths; at most its term")
                else:
                    found = _bound(scene, alone, simpler, visible[number], light, depth, budget)
                    why = "what it adds to its term at most"
                rows.append((Effect(f"{name} {OPTION_NAMES[word]}", True, why, 0.0, found), number, term.label, word))
    return _chosen(rows, surfaces, budget, forced)


def _chosen(
    rows: list[tuple[Effect, int, str, str | None]],
    surfaces: list[Surface],
    budget: float,
    forced: Mapping[str, bool],
) -> tuple[list[Effect], list[Surface]]:
    """The rows with their decisions: smallest bound first, while they add up to no more than the budget."""
    made, spent, gone = {}, 0.0, set()
    for effect, number, label, word in sorted(rows, key=lambda row: (row[0].error, row[3] is not None)):
        with_its_term = word is not None and (number, label) in gone
        bound = 0.0 if with_its_term else effect.error
        never = word == "anisotropic" and bound > 0 and effect.name not in forced  # two widths have no mean to keep
        off = not forced.get(effect.name, not (spent + bound <= budget and not never))
        if off:
            spent += bound if effect.name not in forced else 0.0
            if word is None:
                gone.add((number, label))
            surface = surfaces[number]
            if word is None:
                surfaces[number] = replace(surface, dropped=surface.dropped | {label})
            else:
                words = surface.simpler.get(label, frozenset()) | {word}
                surfaces[number] = replace(surface, simpler={**surface.simpler, label: words})
        reason = "its term is off" if with_its_term else effect.reason
        made[effect.name] = replace(effect, on=not off, reason=reason, error=bound, forced=effect.name in forced)
    return [made[row[0].name] for row in rows], surfaces


def _bound(
    scene: Scene,
    whole: Surface,
    less: Surface,
    visible: contributions.Seen,
    light: Lighting,
    depth: int,
    budget: float,
) -> float:
    """What the image loses at most where `less` takes the place of `whole` [radiance]."""
    bound = contributions.lost_highlight(scene, whole, less, visible.vertices, budget)
    if light.even:
        tolerance = min(max(1e-2 * budget / light.even, 1e-9), 1e-3)
        bound += light.even * contributions.lost_albedo(whole, less, visible.farthest, tolerance)
    if depth and bound <= budget:
        lost = contributions.lost_albedo(whole, less, contributions.GRAZING, 1e-6)
        peak = contributions.diffuse_peak(whole)
        if light.albedo >= 1 or light.in_mean or (light.irradiance and math.isinf(peak)):
            return math.inf
        indirect = light.direct / (1 - light.albedo)
        again = lost * light.even + (peak * light.irradiance if light.irradiance else 0.0) + lost * indirect
        bound += lost * indirect + again * light.albedo / (1 - light.albedo)
    return bound


def _name(scene: Scene, index: int) -> str:
    """The name of an object, or its kind and number."""
    shape = scene.objects[index]
    lone = sum(other.name == shape.name for other in scene.objects) == 1
    return shape.name if shape.name and lone else f"{shape.name or type(shape).__name__.lower()} {index + 1}"


def _is_zero(model: Model, own: Values) -> bool:
    return all(float(c.detach().abs().max()) == 0 for c in model.coefficients(own))
