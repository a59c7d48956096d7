"""Values that Radiance's rtrace computes for a material, pair of directions by pair of directions.

rtrace is given one scene: a distant light, and a sphere a pair of directions, turned so that the pair's wi meets the
light. A ray along -wo hits it where its normal is the frame's z, and returns f cos theta_i times the light's radiance
and solid angle, which a Lambertian sphere in the same scene measures. A sphere, since on a flat surface Radiance widens
the lobe by the light's own width; light and lobe are of single precision, and a lobe below 1e-6 counts as dark.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

radiance = pytest.importorskip("pyradiance", reason="needs the renderer Radiance: pip install -e '.[peers]'")

Array = np.ndarray
SUN = np.array([0.36, -0.48, 0.8])
APART = 100.0  # between spheres of radius 1, across the light
# no jitter, no interreflection, no sampled highlights, no light too dim to count: what is left is the direct term
PARAMETERS = ["-ab", "0", "-dj", "0", "-dt", "0", "-dc", "1", "-st", "1", "-lw", "0"]

Material = Callable[[int, Array], str]  # number and x axis -> the text of "m<number>", whose modifiers may precede it


def frames(rng: np.random.Generator, wi: Array) -> Array:
    """Rotations (n, 3, 3), random but for taking each wi to the light."""

    def basis(w: Array) -> Array:
        side = np.cross(w, rng.normal(size=3))
        side /= np.linalg.norm(side)
        return np.stack([side, np.cross(w, side), w], -1)

    return np.stack([basis(SUN) @ basis(w).T for w in wi])


def rendered(folder: Path, wi: Array, wo: Array, turned: Array, material: Material) -> Array:
    """f [1/sr] that Radiance has for each pair, (n, 3), from one octree and one run of rtrace."""
    across = np.cross(SUN, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    scene = [
        "void light bright 0 0 3 1e6 1e6 1e6",
        f"bright source sun 0 0 4 {' '.join(map(repr, map(float, SUN)))} 0.5",
        "void plastic m0 0 0 5 0.5 0.5 0.5 0 0",
        f"m0 sphere s0 0 0 4 {' '.join(repr(float(c)) for c in -SUN)} 1",
    ]
    rays = [[*SUN, *-SUN]]
    for number, rotation in enumerate(turned, 1):
        x, z, to_eye = rotation[:, 0], rotation[:, 2], rotation @ wo[number - 1]
        hit = APART * number * across
        scene += [material(number, x), f"m{number} sphere s{number} 0 0 4 {' '.join(map(repr, map(float, hit - z)))} 1"]
        rays.append([*(hit + to_eye), *-to_eye])
    (folder / "scene.rad").write_text("\n".join(scene))
    (folder / "scene.oct").write_bytes(radiance.oconv(folder / "scene.rad"))
    answer = radiance.rtrace(
        np.array(rays).tobytes(), folder / "scene.oct", header=False, inform="d", outform="d", params=PARAMETERS
    )
    values = np.frombuffer(answer).reshape(-1, 3)
    light = values[0] / (0.5 / np.pi)  # met at its normal
    return values[1:] / light / wi[:, 2:]
