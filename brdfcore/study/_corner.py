"""What each effect of a scene is worth: a ball in an open corner without one of them after the other."""

import dataclasses

from ..plots._panels import Curve, Panel
from ..render import Camera, Dome, Plan, Plane, Rectangle, RectangleLight, Scene, Sphere, plan
from ..render import render as image_of
from ._images import row, timed
from ._study import Cell
from ._timing import interleaved

BOUNCES = 3
SHORT = 64  # samples of the runs that are timed
BALL = "coupled_lambert(kd=0.4, f0=ggx.f0) + ggx(anisotropic, schlick, ks=1, f0=0.05, ax=0.1, ay=0.3)"
SHOWN = ("lambert", "ggx", "fresnel", "shadow rays", "light sampling", "interreflection 1", "interreflection 2")


def corner(size: int, samples: int) -> Scene:
    """The scene."""
    objects = (
        Sphere(center=(0, 0, 1), radius=1, material=BALL, name="ball"),  # type: ignore[arg-type]
        Plane(material="lambert(kd=[0.6, 0.4, 0.3])", name="floor"),  # type: ignore[arg-type]
        Rectangle(center=(-1.5, 0, 2), edge_u=(0, 6, 0), edge_v=(0, 0, 4), material="lambert(kd=0.6)", name="wall"),  # type: ignore[arg-type]
    )
    lamp = RectangleLight(center=(2, -3, 5), edge_u=(0, 2, 0), edge_v=(2, 0, 0), radiance=4.0)
    view = Camera(position=(7, 1, 2.5), look_at=(0, 0, 0.9), width=size, height=size)
    return Scene(camera=view, objects=objects, lights=(lamp, Dome(radiance=0.3)), samples=samples)


def effects_of_a_corner(
    size: int, samples: int, seed: int, rounds: int
) -> tuple[list[tuple[Cell, ...]], dict[str, tuple[float, float]], Panel]:
    """The rows of the images; each effect's share of the time, of so many rounds, and the error without it; a panel."""
    scene = corner(size, samples)
    whole = plan(scene, 1e-3, bounces=BOUNCES)
    names = [effect.name for effect in whole.effects if effect.on and effect.name.endswith(SHOWN)]
    plans = {"everything": whole} | {f"without {n}": plan(scene, 1e-3, {n: False}, BOUNCES) for n in names}
    reference, _ = timed(dataclasses.replace(scene, samples=4 * samples), whole, seed + 1)
    times = _times(scene, plans, seed, rounds)
    rows = [row("corner", label, timed(scene, made, seed)[0], times[label], reference) for label, made in plans.items()]
    found = {str(cells[1]): (float(cells[3] or 0), float(cells[4] or 0)) for cells in rows}
    full = times["everything"]
    worth = {name: (1 - found[f"without {name}"][0] / full, found[f"without {name}"][1]) for name in names}
    points = tuple(Curve(label, (seconds,), (error,)) for label, (seconds, error) in found.items())
    return rows, worth, Panel("a ball in an open corner", points)


def _times(scene: Scene, plans: dict[str, Plan], seed: int, rounds: int) -> dict[str, float]:
    """The seconds of each plan: by turns, of few samples, and as many times as long as there are more."""
    short = dataclasses.replace(scene, samples=min(scene.samples, SHORT))
    made = {label: dataclasses.replace(one, scene=short) for label, one in plans.items()}
    tasks = {label: lambda one=one: image_of(short, one, seed=seed) for label, one in made.items()}
    times = interleaved(tasks, rounds, warm=True)
    return {label: seconds * scene.samples / short.samples for label, seconds in times.items()}
