"""Values against Radiance: its WGMDfunc is `lambert + ward_bounded`, its ashik2 documented though not the textbook's.

rtrace is given one scene: a distant light, and a sphere a pair of directions, turned so that the pair's wi meets the
light. A ray along -wo hits it where its normal is the frame's z, and returns f cos theta_i times the light's radiance
and solid angle, which a Lambertian sphere in the same scene measures. A sphere, since on a flat surface Radiance widens
the lobe by the light's own width; light and lobe are of single precision, and a lobe below 1e-6 counts as dark.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from model_cases import hemisphere

import brdfcore as bc

radiance = pytest.importorskip("pyradiance", reason="needs the renderer Radiance: pip install -e '.[peers]'")

Array = np.ndarray
PAIRS = 300
SUN = np.array([0.36, -0.48, 0.8])
APART = 100.0  # between spheres of radius 1, across the light
PRECISION = 1e-6
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


def pairs(rng: np.random.Generator, lobe: bc.Material) -> tuple[torch.Tensor, torch.Tensor]:
    """Directions (wi, wo), half of them where the lobe reflects and half anywhere, none within 3 degrees of grazing."""
    wo = hemisphere(rng, 8 * PAIRS)
    drawn = lobe.sample(wo, torch.tensor(rng.uniform(0, 1, (8 * PAIRS, 3)))).detach()
    wi = torch.where(torch.tensor(rng.uniform(0, 1, (8 * PAIRS, 1)) < 0.5), drawn, hemisphere(rng, 8 * PAIRS))
    keep = (wi[:, 2] > 0.05) & (wo[:, 2] > 0.05)
    return wi[keep][:PAIRS], wo[keep][:PAIRS]


WARD = [
    ([0.1, 0.1, 0.1], [0.3, 0.3, 0.3], "a=0.2"),
    ([0.3, 0.2, 0.1], [0.05, 0.1, 0.2], "a=0.05"),
    ([0.0, 0.0, 0.0], [0.9, 0.5, 0.1], "ax=0.1, ay=0.3"),
    ([0.5, 0.1, 0.02], [0.2, 0.3, 0.4], "ax=0.6, ay=0.08"),
]


@pytest.mark.parametrize(("kd", "rs", "width"), WARD)
def test_ward_bounded_is_radiances_wgmdfunc(tmp_path, kd, rs, width):
    """kd/pi + rs |H|^2 E / (pi ax ay Hz^4): the colour of the lobe is its modifier's."""
    widths = [word.split("=")[1] for word in width.split(", ")]
    ours = bc.material(f"lambert(kd={kd}) + ward_bounded(rs={rs}, {width})")
    rng = np.random.default_rng(91)
    wi, wo = pairs(rng, bc.material(f"ward_bounded({width})"))

    def material(number: int, x: Array) -> str:
        red, green, blue = rs
        front = " ".join(map(str, kd))
        axis = " ".join(f"{c:.17f}" for c in x)
        return (
            f"void colorfunc c{number} 4 {red} {green} {blue} . 0 0\n"
            f"void WGMDfunc m{number} 13 c{number} 1 {widths[0]} {widths[-1]} void 0 0 0 void {axis} . "
            f"0 9 {front} 0 0 0 0 0 0"
        )

    theirs = rendered(tmp_path, wi.numpy(), wo.numpy(), frames(rng, wi.numpy()), material)
    f = ours.f(wi, wo).detach().numpy()
    assert len(f) == PAIRS
    assert f[:, 0].max() > 3 * np.median(f[:, 0])  # the lobe is in it
    np.testing.assert_allclose(theirs, f, rtol=PRECISION, atol=1e-6)


@pytest.mark.parametrize(("nu", "nv"), [(10, 10), (100, 100), (400, 20), (5, 2000)])
def test_ashikhmin_and_shirleys_lobe_is_that_of_radiances_ashik2(tmp_path, nu, nv):
    """Its Schlick factor is of n.v and its diffuse term is d/pi (1 - (1 - n.l)^5); the lobe between them is ours."""
    diffuse, specular = np.array([0.3, 0.2, 0.1]), np.array([0.05, 0.3, 0.8])
    lobe = bc.material(f"ashikhmin_shirley(constant, ks=1, nu={nu}, nv={nv})")
    rng = np.random.default_rng(92)
    wi, wo = pairs(rng, lobe)

    def material(number: int, x: Array) -> str:
        axis = " ".join(f"{c:.17f}" for c in x)
        colours = " ".join(f"{c}" for c in (*diffuse, *specular))
        return f"void ashik2 m{number} 4 {axis} . 0 8 {colours} {nu} {nv}"

    theirs = rendered(tmp_path, wi.numpy(), wo.numpy(), frames(rng, wi.numpy()), material)
    ci, co = wi.numpy()[:, 2:], wo.numpy()[:, 2:]
    fresnel = specular + (1 - specular) * (1 - co) ** 5
    f = diffuse / np.pi * (1 - (1 - ci) ** 5) + fresnel * lobe.f(wi, wo).detach().numpy()
    np.testing.assert_allclose(theirs, f, rtol=PRECISION, atol=1e-6)
