"""The plan of an image: which effects a scene calls for, decided from bounds before anything is simulated.

Half of the tolerance may go into interreflections that are cut off, and the rest into terms and options that are left
out, smallest first, as long as their bounds add up to no more. With A the largest albedo of the scene's materials and D
the largest radiance that leaves a surface by direct light, what leaves after j interreflections is at most A^j D, and
all from the jth on A^j D / (1 - A). Under lights without extent a lobe's D has no bound, since a caustic may be as
bright as it likes; there the number of bounces follows from the mean radiance, A E / pi, and the table says so.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

from ..errors import InvalidValueError, unknown_name
from ..tabulated import Tabulated
from . import _checks, contributions
from .effects import (
    BRDF_SAMPLING,
    CLOSED_FORM,
    INTERREFLECTION,
    LIGHT_SAMPLING,
    LOOK_UP,
    SHADOWS,
    WEIGHTS,
    Effect,
    Plan,
)
from .lights import AreaLight, DeltaLight, Dome
from .measured import AnySurface, Measured, surface
from .scene import Scene
from .surfaces import Surface
from .terms import Lighting, decide

BOUNCES = 32  # at most, unless asked for otherwise


def plan(
    scene: Scene, tolerance: float = 1e-3, force: Mapping[str, bool] | None = None, bounces: int = BOUNCES
) -> Plan:
    """The plan of a scene, whose image differs from that of everything by at most the tolerance [radiance].

    force    effect's name -> on or off, whatever the bounds say; "interreflection 2" off ends paths after one bounce,
             on brings the first too
    bounces  the most interreflections that are thought of, up to 1024
    Raises InvalidValueError for a tolerance below 0, where nothing is left to sample a light with, and for an albedo
    look-up where it would be wrong; UnknownNameError for an effect that the scene does not have.
    """
    if not (_checks.finite(tolerance) and tolerance >= 0):
        raise InvalidValueError(
            f"Expected tolerance to be a finite number from 0, got {tolerance!r}. It is a radiance.", field="tolerance"
        )
    _checks.whole("bounces", bounces, 0, 1024)
    forced = dict(force or {})
    for name, value in forced.items():
        if not isinstance(value, bool):
            raise InvalidValueError(
                f"Expected force of {name!r} to be True or False, got {value!r}. Write one of them.", field="force"
            )
    lone = len(scene.objects) == 1
    materials = list({id(shape.material): shape.material for shape in scene.objects}.values())
    place = {id(material): number for number, material in enumerate(materials)}
    surface_of = tuple(place[id(shape.material)] for shape in scene.objects)
    surfaces = [surface(material) for material in materials]
    light = _light(scene, surfaces, lone)
    interreflections = _bounces(scene, light, lone, tolerance, forced, bounces)
    depth = sum(effect.on for effect in interreflections)
    cut = max((effect.error for effect in interreflections if not effect.on and not effect.forced), default=0.0)
    terms, surfaces = decide(scene, surfaces, surface_of, light, depth, max(tolerance - cut, 0.0), forced)
    sampling = _sampling(scene, surfaces, lone, forced)
    effects = _costed([*terms, *sampling, *interreflections], scene, surfaces, depth)
    for name in forced:
        if name not in [effect.name for effect in effects]:
            raise unknown_name("an effect", name, [effect.name for effect in effects], field="force")
    on = {effect.name for effect in effects if effect.on}
    if WEIGHTS not in on:
        surfaces = [replace(analytic, uniform_weights=True) for analytic in _analytic(surfaces, WEIGHTS, "on")]
    if LOOK_UP in on:
        _analytic(surfaces, LOOK_UP, "off")
        if not lone or WEIGHTS not in on:
            raise InvalidValueError(
                f"Expected {LOOK_UP} to be off where there are several objects or uniform weights, got it forced on. "
                "An albedo is what one convex object shows.",
                field="force",
            )
    sampled = [a for a in scene.lights if isinstance(a, AreaLight) and not (isinstance(a, Dome) and LOOK_UP in on)]
    if sampled and not {LIGHT_SAMPLING, BRDF_SAMPLING} & on:
        raise InvalidValueError(
            f"Expected {LIGHT_SAMPLING} or {BRDF_SAMPLING} to be on, got both forced off with a light to sample. "
            "Leave one on.",
            field="force",
        )
    finest = 0.1 * tolerance / light.even if light.even else 1e-4
    return Plan(scene, tolerance, tuple(effects), tuple(surfaces), surface_of, depth, min(max(finest, 1e-10), 1e-2))


def everything(scene: Scene, bounces: int = 8) -> Plan:
    """The plan with every effect on and nothing looked up: what planned images are compared with."""
    first = plan(scene, 0.0, {f"{INTERREFLECTION} {k + 1}": True for k in range(bounces)}, bounces)
    force = {effect.name: effect.name != LOOK_UP for effect in first.effects}
    return plan(scene, 0.0, force, bounces)


def _analytic(surfaces: list[AnySurface], name: str, due: str) -> list[Surface]:
    """The surfaces, where none is a table; an effect that a table does not have is told."""
    found = [surface for surface in surfaces if isinstance(surface, Surface)]
    if len(found) < len(surfaces):
        raise InvalidValueError(
            f"Expected {name} to be {due} where a material is measured, got it forced. A table is only sampled.",
            field="force",
        )
    return found


def _light(scene: Scene, surfaces: list[AnySurface], lone: bool) -> Lighting:
    irradiance = contributions.irradiance(scene)
    albedo = 0.0 if lone else max(contributions.largest_albedo(surface) for surface in surfaces)
    peak = max(surface.peak for surface in surfaces)
    in_mean = irradiance > 0 and math.isinf(peak)
    from_points = albedo * irradiance / math.pi if in_mean else (peak * irradiance if irradiance else 0.0)
    light = Lighting(tuple(contributions.lamps(scene)), irradiance, albedo, from_points, in_mean)
    return replace(light, direct=from_points + light.reflected(albedo, peak))


def _bounces(
    scene: Scene, light: Lighting, lone: bool, tolerance: float, forced: Mapping[str, bool], bounces: int
) -> list[Effect]:
    """The interreflections: those that are on, and the first that is not, which stands for all beyond it."""
    effects: list[Effect] = []
    wanted = [number for number in range(1, bounces + 1) if forced.get(f"{INTERREFLECTION} {number}")]
    measured = any(isinstance(shape.material, Tabulated) for shape in scene.objects)
    for number in range(1, bounces + 2):
        name = f"{INTERREFLECTION} {number}"
        if lone:
            tail, reason = 0.0, "one convex object does not light itself"
        elif light.albedo < 1:
            tail = light.albedo**number * light.direct / (1 - light.albedo)
            reason = f"largest albedo {light.albedo:.3g}" + (", estimated for a table" if measured else "")
            if light.in_mean:
                reason += "; in the mean, caustics have no bound"
        else:
            tail, reason = math.inf, f"largest albedo {light.albedo:.3g}: the series does not fall"
        on = forced.get(name, tail > tolerance / 2 or number < max(wanted, default=0))
        if number > bounces:
            on, reason = False, f"beyond the limit of {bounces} bounces"
        estimated = math.isfinite(tail) and not lone and (light.in_mean or measured)
        effects.append(Effect(name, on, reason, 0.0, tail, name in forced, estimated=estimated))
        if not on:
            break
    return effects


def _sampling(scene: Scene, surfaces: list[AnySurface], lone: bool, forced: Mapping[str, bool]) -> list[Effect]:
    """How light is gathered."""
    points = any(isinstance(a, DeltaLight) for a in scene.lights)
    dome = any(isinstance(a, Dome) for a in scene.lights)
    extended = any(isinstance(a, AreaLight) and not isinstance(a, Dome) for a in scene.lights)
    lobes = any(math.isinf(surface.peak) for surface in surfaces)
    near = contributions.near(scene)
    measured = any(isinstance(surface, Measured) for surface in surfaces)
    right = forced.get(WEIGHTS, True)
    look_up = forced.get(LOOK_UP, dome and lone and right and not measured)
    sampled_dome = dome and not look_up
    even = "even light on one convex object"
    effects = [
        (
            CLOSED_FORM,
            points,
            "lights without extent" if points else "no light without extent",
            math.inf if points else 0.0,
        ),
        (
            LOOK_UP,
            look_up,
            even if look_up else "a table is only sampled" if dome and lone and measured else f"no {even}",
            0.0,
        ),
        (
            SHADOWS,
            not lone,
            "one convex object casts no shadow on itself" if lone else "objects may shade each other",
            0.0 if lone else math.inf,
        ),
        (
            LIGHT_SAMPLING,
            extended,
            "lights of a limited extent" if extended else "no light of a limited extent is sampled",
            0.0,
        ),
        (
            BRDF_SAMPLING,
            sampled_dome or near or (extended and lobes),
            "even light comes from everywhere"
            if sampled_dome
            else "lobes may be narrower than lights"
            if extended and lobes
            else ("a light is near and large" if near else "nothing that needs it"),
            0.0,
        ),
        (WEIGHTS, True, "f cos theta_i / pdf; without it, samples count with the reflectance", math.inf),
    ]
    return [
        Effect(name, forced.get(name, on), reason, 0.0, error, name in forced) for name, on, reason, error in effects
    ]


def _costed(effects: list[Effect], scene: Scene, surfaces: list[AnySurface], depth: int) -> list[Effect]:
    """The effects with the term evaluations and ray tests that they take, over all rays and samples."""
    rays = scene.camera.width * scene.camera.height * scene.camera.grid**2
    samples = max(2, math.ceil(scene.samples / scene.camera.grid**2))
    paths = rays * samples
    terms = sum(surface.count for surface in surfaces) / len(surfaces)
    delta = sum(isinstance(a, DeltaLight) for a in scene.lights)
    area = len(scene.lights) - delta
    on = {effect.name for effect in effects if effect.on}
    sampled = bool({LIGHT_SAMPLING, BRDF_SAMPLING} & on)
    costs = {
        CLOSED_FORM: rays * delta * terms,
        LOOK_UP: float(rays),
        SHADOWS: len(scene.objects) * (rays * delta + (paths * (area + 1) if sampled else 0)),
        LIGHT_SAMPLING: paths * area * terms * (2 if BRDF_SAMPLING in on else 1),
        BRDF_SAMPLING: paths * terms * 2,
    }
    evaluations = rays * delta + (paths * (area + 1) if sampled else 0)
    bounce = paths * (len(scene.objects) + terms * (3 + delta + area))
    return [
        replace(
            effect,
            cost=float(
                costs.get(effect.name, bounce if effect.bounce else 0)
                if ": " not in effect.name
                else evaluations / len(surfaces)
            ),
        )
        for effect in effects
    ]
