"""The same scene in Mitsuba 3: rays that see a GGX ball on an anisotropic GGX floor, with interreflections and shadows.

Mitsuba's rough conductor without a material is the lobe with F = 1; its masking is separable, its alpha is our a. A
pinhole's pixel would be a mean over its area there and its centre here, so each of our rays is a radiance meter there.
"""

import math
import time

import numpy as np
import pytest
import torch
from render_cases import sidak

from brdfcore.render import Camera, Directional, Dome, Rectangle, RectangleLight, Scene, Sphere, plan, render

mitsuba = pytest.importorskip("mitsuba", reason="needs the renderer Mitsuba 3: pip install -e '.[peers]'")

PASSES, EACH = 16, 32  # of Mitsuba: its noise is what they differ by
BOUNCES = 2
PLACE, SIZE = (4.0, 0.5, 1.7), 8
BALL = {"ks": [0.9, 0.6, 0.3], "a": 0.3}
FLOOR = {"ks": 0.5, "ax": 0.2, "ay": 0.5}
LIGHTS = {
    "directional": Directional(direction=(1, 1, 1), irradiance=2.0),
    "area": RectangleLight(center=(3, 0, 3), edge_u=(0, 2, 0), edge_v=(2**0.5, 0, -(2**0.5)), radiance=4.0),
    "dome": Dome(radiance=1.0),
}


def rgb(value) -> dict:
    return {"type": "rgb", "value": value}


def theirs(name: str) -> dict:
    """The light as Mitsuba knows it."""
    light = LIGHTS[name]
    if isinstance(light, Directional):
        return {"type": "directional", "direction": [-x for x in light.direction], "irradiance": rgb(light.irradiance)}
    if isinstance(light, Dome):
        return {"type": "constant", "radiance": rgb(light.radiance)}
    assert isinstance(light, RectangleLight)
    facing = np.cross(light.edge_u, light.edge_v)
    place = mitsuba.ScalarTransform4f().look_at(
        origin=list(light.center), target=list(light.center + facing), up=list(light.edge_v)
    )
    return {"type": "rectangle", "to_world": place, "shines": {"type": "area", "radiance": rgb(light.radiance)}}


def conductor(ks, **widths) -> dict:
    lobe = {"type": "roughconductor", "material": "none", "distribution": "ggx", "sample_visible": True}
    return lobe | {"specular_reflectance": rgb(ks)} | widths


def film(width: int) -> dict:
    return {"type": "hdrfilm", "width": width, "height": 1, "rfilter": {"type": "box"}, "component_format": "float32"}


def peer(name: str, rays: torch.Tensor, samples: int, alone: bool = False):
    """Mitsuba's scene, with a sensor a ray."""
    mitsuba.set_variant("scalar_rgb")
    meters = {
        f"ray{k:05d}": {"type": "radiancemeter", "origin": list(PLACE), "direction": ray, "film": film(1)}
        for k, ray in enumerate(rays.tolist())
    }
    sampler = {"type": "independent", "sample_count": samples}
    ball = {"type": "sphere", "bsdf": conductor(BALL["ks"], alpha=BALL["a"])}
    below = mitsuba.ScalarTransform4f().translate([0, 0, -1]).scale([3, 3, 1])
    floor = {
        "type": "rectangle",
        "to_world": below,
        "bsdf": conductor(FLOOR["ks"], alpha_u=FLOOR["ax"], alpha_v=FLOOR["ay"]),
    }
    return mitsuba.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 2 if alone else BOUNCES + 2, "rr_depth": 100},
            "sensor": {"type": "batch", "film": film(len(rays)), "sampler": sampler} | meters,
            "ball": ball,
            "light": theirs(name),
        }
        | ({} if alone else {"floor": floor})
    )


def passes(made, count: int, first: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """The mean of Mitsuba's images of so many seeds, (N, 3), and its standard errors."""
    images = np.stack([np.array(mitsuba.render(made, seed=first + k))[0] for k in range(count)]).astype(float)
    return images.mean(0), images.std(0, ddof=1) / math.sqrt(count)


def ours(name: str, masking: str = "separable", alone: bool = False, size: int = SIZE, samples: int = 512) -> Scene:
    ball = f"ggx(isotropic, constant, {masking}, ks={BALL['ks']}, a={BALL['a']})"
    floor = f"ggx(anisotropic, constant, {masking}, ks={FLOOR['ks']}, ax={FLOOR['ax']}, ay={FLOOR['ay']})"
    objects = [Sphere(material=ball, center=(0, 0, 0), radius=1)]
    if not alone:
        objects.append(Rectangle(material=floor, center=(0, 0, -1), edge_u=(6, 0, 0), edge_v=(0, 6, 0)))
    view = Camera(position=PLACE, look_at=(0, 0, -0.3), width=size, height=size)
    return Scene(camera=view, objects=objects, lights=[LIGHTS[name]], samples=samples)


def planned(scene: Scene):
    force = {f"interreflection {k + 1}": True for k in range(BOUNCES if len(scene.objects) > 1 else 0)}
    return plan(scene, 0.0, force, bounces=len(force))


def deviations(name: str, masking: str) -> tuple[np.ndarray, float, float, float]:
    """The differences in standard errors, that of the means, the noise as a share of the mean, and what has none.

    The last is the largest relative difference where neither has noise: in direct light without an extent, and the sky.
    """
    scene = ours(name, masking)
    image = render(scene, planned(scene), seed=5)
    mine, noise = (x.reshape(-1, 3).numpy() for x in (image.pixels, image.noise))
    mean, error = passes(peer(name, scene.camera.rays().reshape(-1, 3), EACH), PASSES)
    both = np.sqrt(noise**2 + error**2)
    lit = both > 1e-9
    off = mine - mean
    sure = float((np.abs(off) / np.maximum(mine, 1e-3))[~lit].max(initial=0))
    of_mean = float(np.abs(off.sum(0) / np.sqrt((both**2).sum(0))).max())
    return off[lit] / both[lit], of_mean, float(both.mean() / mean.mean()), sure


@pytest.mark.parametrize("name", LIGHTS)
def test_the_same_scene_is_the_same(name):
    """Every ray and channel, and the mean of each channel, within the noise of both."""
    z, of_mean, noise, sure = deviations(name, "separable")
    assert np.abs(z).max() < 1.3 * sidak(z.size)  # Mitsuba's noise is estimated from few passes
    assert of_mean < sidak(3)
    assert noise < 0.05
    assert sure < 1e-4  # of single precision
    assert np.sqrt(np.mean(z**2)) < 1.2


def test_another_masking_is_told_apart():
    """The test of the test: masking by height is brighter."""
    *_, sure = deviations("directional", "correlated")
    assert sure > 3e-3


@pytest.mark.bench
@pytest.mark.parametrize("name", LIGHTS)
@pytest.mark.parametrize("alone", [False, True], ids=["ball and floor", "ball alone"])
def test_time_to_equal_noise(name, alone, capsys):
    """Processor time times variance, over Mitsuba's; where we are exact, its time to noise of 1e-4 of the mean."""
    scene = ours(name, alone=alone, size=32, samples=512)
    rays, chosen = scene.camera.rays().reshape(-1, 3), planned(scene)
    made = peer(name, rays, 64, alone)
    rows = []
    for turn in range(3):
        begun = time.process_time()
        image = render(scene, chosen, seed=turn)
        middle = time.process_time()
        mean, error = passes(made, 8, first=8 * turn)
        end = time.process_time()
        variances = float(image.noise.square().mean()), float(np.mean(error**2))
        rows.append((middle - begun, end - middle, *variances, mean.mean()))
    mine, other, variance, their_variance, mean = np.median(np.array(rows), axis=0)
    if their_variance < 1e-12 * mean**2:
        words = f"both exact; {mine / (other / (8 * 64)):.3g} times as long as one of Mitsuba's samples"
    elif variance == 0:
        needed = other * their_variance / (1e-4 * mean) ** 2
        words = f"exact in {mine:.2f} s; Mitsuba's time to 1e-4 is {needed / mine:.3g} times as long"
    else:
        words = f"to equal noise, {mine * variance / (other * their_variance):.3g} times as long as Mitsuba's"
    with capsys.disabled():
        print(f"\n{name}, {'ball alone' if alone else 'ball and floor'}: {words}", end="", flush=True)
    assert np.isfinite(variance)
