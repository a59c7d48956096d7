"""A tabletop of metal in the models that were fitted to it, as in Kurt, Szirmay-Kalos and Krivanek's Fig. 9.

The table is seen at a grazing angle, with three balls on it, under a lamp and an even sky; paths are up to five bounces
long. Departure: their scene is the Princeton one, and their nickel a measured one; here the metal is a lobe that none
of the models is (a GGX conductor of about nickel's indices), and each is fitted to its samples, without noise, by the
cube root of f cos theta_i, which looks nearer than least squares of the peak.
"""

import dataclasses
import math
import tempfile
from pathlib import Path

from ..exports import export
from ..fitting import fit
from ..models.material import Material, material
from ..plots import differences
from ..render import Camera, Dome, Image, Plane, RectangleLight, Scene, Sphere, plan
from ..tabulated import Tabulated, lawrence
from ._fit_cases import generated
from ._images import row, timed
from ._study import Cell, Picture

METAL = "ggx(isotropic, conductor, eta=[2.0, 1.8, 1.6], k=[3.7, 3.2, 2.7], ks=1, a=0.15)"
LOBES = {
    "Ashikhmin-Shirley": "ashikhmin_shirley(isotropic, scaled)",
    "Cook-Torrance": "cook_torrance",
    "Edwards": "edwards(ry=edwards.rx)",
    "Ward": "ward(isotropic)",
    "Ward-Duer": "ward_duer(isotropic)",
    "Ward, bounded": "ward_bounded(isotropic)",
    "Kurt": "kurt(isotropic)",
}
QUICK = ("Ward-Duer", "Kurt")
FACTORED = "Lawrence, factored"
SAMPLES = 4000  # that the models are fitted to
STEEPEST = math.radians(80)  # of them, as the literature on measured materials leaves steeper ones out
BALLS = (
    ((0.0, -1.6, 0.6), 0.6, "lambert(kd=[0.6, 0.15, 0.1])"),
    ((-1.0, 0.1, 0.8), 0.8, "lambert(kd=[0.2, 0.4, 0.6])"),
)


def scene_of(table: Material | Tabulated, width: int, samples: int) -> Scene:
    """The tabletop, with a ball of the same metal on it."""
    balls = [Sphere(center=at, radius=r, material=text) for at, r, text in BALLS]  # type: ignore[arg-type]
    metal = Sphere(center=(0.6, 1.4, 0.5), radius=0.5, material=table, name="metal ball")
    view = Camera(position=(7, 0.4, 1.5), look_at=(0, 0, 0.35), width=width, height=5 * width // 8, fov_deg=22)
    lamp = RectangleLight(center=(-3, -1, 3), edge_u=(0, 1.5, 0), edge_v=(0.6, 0, 1.2), radiance=6.0)
    objects = (Plane(material=table, name="table"), metal, *balls)
    return Scene(camera=view, objects=objects, lights=(lamp, Dome(radiance=0.4)), samples=samples)


def factored() -> Tabulated:
    """Lawrence's factors of the metal's table."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "metal.binary"
        export(material(METAL), "merl", path)
        return lawrence(Tabulated.read(path))


def fitted_images(quick: bool, seed: int) -> tuple[list[tuple[Cell, ...]], Picture]:
    """The rows of the images against that of the metal itself, the best first, and their picture."""
    width, samples = (16, 32) if quick else (48, 256)
    data = generated(SAMPLES, seed, METAL, noise=0.0)
    tables: dict[str, Material | Tabulated] = {
        name: fit(data, f"lambert + {text}", loss="cube_root", max_theta=STEEPEST).material
        for name, text in LOBES.items()
        if not quick or name in QUICK
    }
    if not quick:
        tables[FACTORED] = factored()
    truth = scene_of(material(METAL), width, 4 * samples)
    reference, _ = timed(truth, plan(truth, 1e-3, bounces=5), seed + 1)
    again, seconds = timed(dataclasses.replace(truth, samples=samples), plan(truth, 1e-3, bounces=5), seed)
    rows = {"the metal itself": row("fitted table", "the metal itself", again, seconds, reference)}
    pairs: dict[str, tuple[Image, Image]] = {}
    for name, table in tables.items():
        scene = scene_of(table, width, samples)
        image, seconds = timed(scene, plan(scene, 1e-3, bounces=5), seed)
        rows[name] = row("fitted table", name, image, seconds, reference)
        pairs[name] = (image, reference)
    ranked = sorted(rows, key=lambda name: rows[name][4] or 0.0)
    title = "Kurt Fig. 9: a metal table in fitted models"
    shown = {name: pairs[name] for name in ranked if name in pairs}
    return [rows[name] for name in ranked], Picture("render-fitted", title, differences(shown, title))
