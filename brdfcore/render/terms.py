"""Which terms of the materials, and which of their options, an image needs: each with the bound of its absence."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import torch

from ..models.base import Model
from ..parameters import Values
from . import contributions
from .effects import Effect
from .measured import LABEL, AnySurface, Measured
from .scene import Scene
from .surfaces import replaceable, widths

OPTION_NAMES = {"anisotropic": "anisotropy", "schlick": "fresnel", "scaled": "fresnel", "compensated": "compensation"}
ESTIMATED = "a table; of lights with an extent its part is estimated by samples, not bounded"


@dataclass(frozen=True, eq=False)
class Lighting:
    """What the bounds rest on."""

    lamps: tuple[tuple[float, float], ...]  # radiance and largest irradiance of the lights with extent
    irradiance: float  # of those without
    albedo: float  # the largest of the scene
    direct: float  # D [radiance]
    in_mean: bool  # whether D is a mean only

    @property
    def even(self) -> float:
        """The radiance of all lights with an extent together."""
        return sum(radiance for radiance, _ in self.lamps)

    def reflected(self, albedo: float, peak: float) -> float:
        """The largest radiance that these lights have from a part of this albedo and this largest f cos theta_i."""
        return sum(min(radiance * albedo, irradiance * peak) for radiance, irradiance in self.lamps)


@dataclass(frozen=True)
class _Row:
    """An effect that is on so far, and what it belongs to."""

    effect: Effect
    number: int  # of the surface
    label: str  # of the term
    word: str | None = None  # of the option; None for the term itself
    mixed: bool = False  # its absence would take from f and add to it, so that only force leaves it out


def decide(
    scene: Scene,
    surfaces: list[AnySurface],
    surface_of: tuple[int, ...],
    light: Lighting,
    depth: int,
    budget: float,
    forced: Mapping[str, bool],
) -> tuple[list[Effect], list[AnySurface]]:
    """The terms and their options, each with its bound, and the surfaces without those that are left out.

    Of what stays on, the bound is found as far as it takes to know that; of what is forced off, all of it.
    """
    visible = contributions.seen(scene, surface_of, len(surfaces))
    names = _names(scene)
    rows: list[_Row] = []
    for number, surface in enumerate(surfaces):
        owner = names[surface_of.index(number)]

        def bounded(name: str, whole: AnySurface, less: AnySurface, number: int = number) -> tuple[float, bool]:
            enough = math.inf if forced.get(name) is False else budget
            return _bound(scene, whole, less, visible[number], light, depth, budget, enough)

        if isinstance(surface, Measured):
            name = f"{owner}: {LABEL}"
            bound, partial = bounded(name, surface, surface.without(LABEL))
            effect = Effect(name, True, ESTIMATED, 0.0, bound, partial=partial, estimated=bool(light.even or depth))
            rows.append(_Row(effect, number, LABEL))
            continue
        values = surface.values(torch.zeros((), dtype=torch.float64))
        for term in surface.form.terms:
            own = surface.form.of_term(term, values)
            others = frozenset(t.label for t in surface.form.terms if t is not term)
            alone, nothing = replace(surface, dropped=others), replace(surface, dropped=others | {term.label})
            name, bound, partial, reason = f"{owner}: {term.label}", 0.0, False, "its reflectance is 0"
            if not _is_zero(term.model, own):
                (bound, partial), reason = bounded(name, alone, nothing), "its largest part"
            rows.append(_Row(Effect(name, True, reason, 0.0, bound, partial=partial), number, term.label))
            for word in replaceable(term.model):
                swapped = _swapped(term.model, own, word)
                if swapped is None:
                    continue
                needless, why = swapped
                option = f"{name} {OPTION_NAMES[word]}"
                found, unfinished, mixed = 0.0, False, False
                if bound and not needless:
                    mixed = needless is None
                    simpler = replace(alone, simpler={term.label: frozenset({word})})
                    if not mixed:
                        found, unfinished = bounded(option, alone, simpler)
                    elif forced.get(option) is False:  # no more than all of the one and all of the other
                        found = bounded(option, alone, nothing)[0] + bounded(option, simpler, nothing)[0]
                    else:
                        found, unfinished = bound, True
                effect = Effect(option, True, why, 0.0, found, partial=unfinished)
                rows.append(_Row(effect, number, term.label, word, mixed))
    return _chosen(rows, surfaces, budget, forced)


def _swapped(model: Model, own: Values, word: str) -> tuple[bool | None, str] | None:
    """Whether an option's word has no effect for these values, None where its absence takes from f and adds to it too.

    The second is the reason; there is no simpler form at all where the whole is None.
    """
    if word == "anisotropic":
        pair = widths(model, own)
        if pair is None:
            return None
        equal = bool((pair[0] == pair[1]).all())
        return (True, "equal widths") if equal else (None, "unequal widths")
    if word == "compensated":
        return False, "what it returns at most"
    if bool((own["f0"] == 1).all()):
        return True, "its factor is 1"
    return (None, "what is returned depends on it") if "compensated" in model.options else (False, "its largest part")


def _chosen(
    rows: list[_Row], surfaces: list[AnySurface], budget: float, forced: Mapping[str, bool]
) -> tuple[list[Effect], list[AnySurface]]:
    """The rows with their decisions: smallest bound first, while they add up to no more than the budget."""
    made, spent, gone = {}, 0.0, set()
    for row in sorted(rows, key=lambda row: (row.effect.error, row.word is not None)):
        effect, term, surface = row.effect, (row.number, row.label), surfaces[row.number]
        with_its_term = row.word is not None and term in gone
        bound = 0.0 if with_its_term else effect.error
        fits = spent + bound <= budget and not (row.mixed and not with_its_term)
        off = not forced.get(effect.name, not fits)
        if off:
            spent += bound if effect.name not in forced else 0.0
            if row.word is None:
                gone.add(term)
                surface = surface.without(row.label)
            elif not isinstance(surface, Measured):
                words = surface.simpler.get(row.label, frozenset()) | {row.word}
                surface = replace(surface, simpler={**surface.simpler, row.label: words})
            surfaces[row.number] = surface
        reason = "its term is off" if with_its_term else effect.reason
        made[effect.name] = replace(effect, on=not off, reason=reason, error=bound, forced=effect.name in forced)
    return [made[row.effect.name] for row in rows], surfaces


def _bound(
    scene: Scene,
    whole: AnySurface,
    less: AnySurface,
    visible: contributions.Seen,
    light: Lighting,
    depth: int,
    budget: float,
    enough: float,
) -> tuple[float, bool]:
    """What the image loses at most where `less` takes the place of `whole` [radiance].

    The second is whether this is a part of it only, which is more than `enough` already.
    """
    bound, partial = contributions.lost_highlight(scene, whole, less, visible.vertices, enough)
    peak = whole.peak
    if light.even:
        fine = min(max(1e-2 * budget / light.even, 1e-9), 1e-3)
        for tolerance in (contributions.ROUGH, fine):  # what is far too much is known soon
            lost = contributions.lost_albedo(whole, less, visible.farthest, tolerance)
            if light.reflected(max(lost - 2 * tolerance, 0.0), peak) > budget:
                break
        bound += light.reflected(lost, peak)
    if depth and bound > enough:
        partial = True
    elif depth:
        lost = contributions.lost_albedo(whole, less, contributions.GRAZING, 1e-6)
        if light.albedo >= 1 or light.in_mean or (light.irradiance and math.isinf(peak)):
            return math.inf, False
        indirect = light.direct / (1 - light.albedo)
        again = light.reflected(lost, peak) + (peak * light.irradiance if light.irradiance else 0.0) + lost * indirect
        bound += lost * indirect + again * light.albedo / (1 - light.albedo)
    return bound, partial


def _names(scene: Scene) -> list[str]:
    """The objects' names, each another: with its number where it has none, or one that does not tell it apart."""
    given = [shape.name or type(shape).__name__.lower() for shape in scene.objects]
    numbered = [f"{name} {number + 1}" for number, name in enumerate(given)]
    return [
        shape.name if shape.name and given.count(name) == 1 and name not in numbered else other
        for shape, name, other in zip(scene.objects, given, numbered, strict=True)
    ]


def _is_zero(model: Model, own: Values) -> bool:
    return all(float(c.detach().abs().max()) == 0 for c in model.coefficients(own))
