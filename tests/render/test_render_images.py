"""Images against what is known of them: furnaces, form factors, white rooms, and each integrator against the others."""

import math
import struct
import zlib

import numpy as np
import pytest
import torch
from render_cases import BALL, albedos, camera, lone_sphere, visible

from brdfcore.errors import InvalidValueError
from brdfcore.render import (
    Camera,
    Directional,
    Dome,
    Plane,
    Point,
    Rectangle,
    RectangleLight,
    Scene,
    Sphere,
    SphereLight,
    everything,
    plan,
    render,
)
from brdfcore.render._exr import exr

FURNACE = {
    "gray": "lambert(kd=0.5)",
    "coloured": "lambert(kd=[0.1, 0.2, 0.3]) + ggx(isotropic, schlick, f0=0.3, a=0.3)",
    "bounded": "ward_bounded(isotropic, rs=0.9, a=0.3)",
    "anisotropic": "ashikhmin_shirley(anisotropic, f0=0.5, nu=10, nv=100)",
    "compensated": "ggx(isotropic, constant, ks=1, a=0.5, compensated)",
}


@pytest.mark.parametrize("name", FURNACE)
def test_furnace_in_closed_form(name):
    """Every pixel of a lone sphere equals the albedo at its angle to 1e-4, without a random number."""
    scene = lone_sphere(FURNACE[name], [Dome(radiance=1.0)], tangent=(0, 1, 1))
    image = render(scene, tolerance=1e-4)
    rows, expected = albedos(scene)
    assert len(rows) > 30
    assert float((image.pixels.reshape(-1, 3)[rows] - expected).abs().max()) < 1e-4
    assert image.samples == 0
    assert not image.noise.any()


@pytest.mark.parametrize("name", FURNACE)
def test_furnace_by_sampling(name):
    """The same by the materials' samples, within the standard errors that the image states."""
    scene = lone_sphere(FURNACE[name], [Dome(radiance=1.0)], size=8, samples=1024)
    image = render(scene, plan(scene, 1e-4, {"albedo look-up": False}))
    rows, expected = albedos(scene)
    pixels, noise = (x.reshape(-1, 3)[rows] for x in (image.pixels, image.noise))
    off = (pixels - expected).abs()
    assert image.samples == 1024
    assert bool((off <= 4 * noise + 1e-7).all())
    assert 0 < float(noise.mean()) < 0.05 or name == "gray"  # of an even weight nothing varies


def test_a_large_furnace_uses_a_table():
    scene = lone_sphere("ward_bounded(isotropic, rs=0.9, a=0.3)", [Dome(radiance=1.0)], size=64)
    rows, expected = albedos(scene)
    assert len(rows) > 1000
    assert float((render(scene, tolerance=1e-4).pixels.reshape(-1, 3)[rows] - expected).abs().max()) < 1e-4


def test_delta_lights_are_exact_and_draw_nothing(monkeypatch):
    monkeypatch.setattr(torch, "rand", lambda *a, **k: pytest.fail("a random number was drawn"))
    material = "lambert(kd=[0.2, 0.3, 0.4]) + ward_bounded(isotropic, rs=0.2, a=0.2)"
    lights = [Directional(direction=(1, 1, 1), irradiance=[1, 2, 3]), Point(position=(3, 0, 3), intensity=5.0)]
    scene = lone_sphere(material, lights)
    image = render(scene, tolerance=0.0)
    rows, vertices = visible(scene)
    expected = torch.zeros(len(rows), 3, dtype=torch.float64)
    to_point = torch.tensor([3.0, 0.0, 3.0], dtype=torch.float64) - vertices.point
    for wi, irradiance in (
        (torch.full((len(rows), 3), 3**-0.5, dtype=torch.float64), torch.tensor([1.0, 2.0, 3.0])),
        (to_point / to_point.norm(dim=1, keepdim=True), 5 / to_point.square().sum(1, keepdim=True)),
    ):
        local = vertices.local(wi)
        with torch.no_grad():
            f = scene.objects[0].material.f(local, vertices.wo)
        expected += f * local[:, 2:].clamp(min=0) * irradiance
    torch.testing.assert_close(image.pixels.reshape(-1, 3)[rows], expected, rtol=1e-9, atol=1e-12)
    assert float(expected.max()) > 0.3


WAYS = {
    "light": {"light sampling": True, "brdf sampling": False},
    "brdf": {"light sampling": False, "brdf sampling": True},
    "both": {"light sampling": True, "brdf sampling": True},
}
OVERHEAD = {
    # irradiance of a diffuse floor: pi L r^2 / d^2 below a sphere, and four times the form factor to a corner
    "sphere": (SphereLight(center=(0, 0, 3), radius=1, radiance=2.0), 2 / 9),
    "rectangle": (
        RectangleLight(center=(0, 0, 2), edge_u=(0, 2, 0), edge_v=(2, 0, 0), radiance=2.0),
        2 * 4 / math.pi * (1 / math.sqrt(5)) * math.atan(1 / math.sqrt(5)),
    ),
    "dome": (Dome(radiance=0.7), 0.7),
}


@pytest.mark.parametrize("light", OVERHEAD)
@pytest.mark.parametrize("way", WAYS)
def test_diffuse_floor_under_a_light(light, way):
    lamp, expected = OVERHEAD[light]
    view = Camera(position=(1, 0, 0.5), look_at=(0, 0, 0), fov_deg=0.01, width=1, height=1)
    scene = Scene(camera=view, objects=[Plane(material="lambert(kd=1)")], lights=[lamp], samples=4096)
    image = render(scene, plan(scene, 1e-9, {**WAYS[way], "albedo look-up": False}))
    error = float(image.noise.max())
    assert float((image.pixels - expected).abs().max()) <= 4 * error + 1e-6
    assert error < 0.02


def test_a_large_light_near_by_is_sampled_by_the_material_too():
    """An endless ceiling is an even sky; points drawn on it lie mostly at its far ends."""
    lamp = RectangleLight(center=(0, 0, 1), edge_u=(0, 100, 0), edge_v=(100, 0, 0), radiance=1.0)
    view = Camera(position=(3, 0, 0.8), look_at=(0, 0, 0), fov_deg=10, width=4, height=4)
    scene = Scene(camera=view, objects=[Plane(material="lambert(kd=1)")], lights=[lamp], samples=256)
    image = render(scene)
    assert image.plan["brdf sampling"].reason == "a light is near and large"
    assert float((image.pixels - 1).abs().max()) < 0.05


def test_shadows():
    """A sphere between a light and the floor: dark where it blocks, and nothing else is changed."""
    view = Camera(position=(3, 0, 1.5), look_at=(0, 0, 0), fov_deg=20, width=16, height=16)
    floor, ball = Plane(material="lambert(kd=1)"), Sphere(material="lambert(kd=0)", center=(0, 0, 3), radius=0.5)
    sun = Directional(direction=(0, 0, 1), irradiance=math.pi)
    scene = Scene(camera=view, objects=[floor, ball], lights=[sun])
    rows, vertices = visible(scene)
    image = render(scene, tolerance=1e-3).pixels.reshape(-1, 3)[rows, 0]
    dark = vertices.point[:, :2].norm(dim=1) < 0.5
    assert 5 < int(dark.sum()) < len(rows) - 5
    assert torch.equal(image[dark], torch.zeros_like(image[dark]))
    torch.testing.assert_close(image[~dark], torch.ones_like(image[~dark]))
    assert not bool(render(scene, plan(scene, 1e-3, {"shadow rays": False})).pixels.reshape(-1, 3)[rows].eq(0).any())


@pytest.mark.parametrize("turned", [False, True], ids=["level", "tilted"])
@pytest.mark.parametrize("light", [Directional(direction=(0.3, 0.2, 1), irradiance=math.pi), Dome(radiance=1.0)])
def test_a_rug_on_a_floor_is_not_shaded_by_it(light, turned):
    """Shapes of one plane do not shade each other by rounding, and the first of them is seen."""
    u, v, up = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    if turned:
        up = (0.3 / 1.13**0.5, 0.2 / 1.13**0.5, 1 / 1.13**0.5)
        u = (up[2] / math.hypot(up[0], up[2]), 0.0, -up[0] / math.hypot(up[0], up[2]))
        v = (up[1] * u[2] - up[2] * u[1], up[2] * u[0] - up[0] * u[2], up[0] * u[1] - up[1] * u[0])
    view = Camera(position=(4.1, 0.37, 2.3), look_at=(0.1, 0.03, 0), width=24, height=24, fov_deg=5)
    rug = Rectangle(center=(0, 0, 0), edge_u=u, edge_v=v, material="lambert(kd=0.6)")
    floor = Plane(
        point=[0.1 * (a + b) for a, b in zip(u, v, strict=True)], normal_direction=up, material="lambert(kd=0)"
    )
    image = render(Scene(camera=view, objects=[rug, floor], lights=[light], samples=2)).pixels
    facing = 1.0 if isinstance(light, Dome) else sum(a * b for a, b in zip(light.direction, up, strict=True))
    torch.testing.assert_close(image, torch.full_like(image, 0.6 * facing))


def test_a_white_room_is_as_bright_as_the_sky():
    """Whatever the shapes, where everything reflects all light, everything is as bright: all bounces are there."""
    objects = [
        Plane(material="lambert(kd=1)"),
        Sphere(material="lambert(kd=1)", center=(0, 0, 1), radius=1),
        Rectangle(material="lambert(kd=1)", center=(-1.2, 0, 1), edge_u=(0, 3, 0), edge_v=(0, 0, 2)),
    ]
    scene = Scene(camera=camera(8, (6, 0, 3)), objects=objects, lights=[Dome(radiance=1.0)], samples=64)
    image = render(scene)
    assert image.plan.depth == 32
    assert float((image.pixels - 1).abs().max()) <= 4 * float(image.noise.max()) + 1e-3
    once = render(scene, plan(scene, 1e-3, {"interreflection 1": False})).pixels
    assert float(once.min()) < 0.8


def test_noise_is_what_it_says_and_stops():
    scene = lone_sphere("lambert(kd=0.5)", [SphereLight(center=(3, 3, 3), radius=1, radiance=5.0)], samples=4096)
    quick = Scene(camera=scene.camera, objects=scene.objects, lights=scene.lights, samples=4096, noise=2e-3)
    shares: list[float] = []
    image = render(quick, progress=shares.append)
    assert float(image.noise.square().mean().sqrt()) <= 2e-3
    assert image.samples < 4096
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    other = render(quick, seed=1)
    z = (image.pixels - other.pixels) / (image.noise.square() + other.noise.square()).sqrt().clamp(min=1e-9)
    lit = image.noise[..., 0] > 1e-4
    assert 0.7 < float(z[lit][:, 0].square().mean().sqrt()) < 1.4
    assert torch.equal(image.pixels, render(quick).pixels)


def test_progress_is_told_tile_after_tile(monkeypatch):
    """The first pass of a large image may take long."""
    monkeypatch.setattr("brdfcore.render.progressive.TILE", 512)
    scene = lone_sphere("lambert(kd=0.5)", [SphereLight(center=(3, 3, 3), radius=1, radiance=5.0)], samples=32)
    shares: list[float] = []
    render(scene, progress=shares.append)
    assert shares == [(k + 1) / 10 for k in range(10)]


def test_a_raster_of_rays_is_their_mean():
    lights = [Directional(direction=(1, 1, 1), irradiance=1.0)]
    fine = Scene(camera=camera(8), objects=[Sphere(material="lambert", **BALL)], lights=lights)
    coarse = Scene(camera=camera(4, grid=2), objects=fine.objects, lights=lights)
    pixels = render(fine).pixels.reshape(4, 2, 4, 2, 3).mean((1, 3))
    torch.testing.assert_close(render(coarse).pixels, pixels)


def test_a_noisy_raster_states_its_noise():
    lights = [SphereLight(center=(3, 3, 3), radius=1, radiance=5.0)]
    ball = [Sphere(material="lambert(kd=0.5)", **BALL)]
    scene = Scene(camera=camera(6, grid=2), objects=ball, lights=lights, samples=256)
    images = [render(scene, seed=seed) for seed in (0, 1)]
    z = (images[0].pixels - images[1].pixels) / (2**0.5 * images[0].noise.clamp(min=1e-9))
    assert 0.6 < float(z[images[0].noise > 1e-4].square().mean().sqrt()) < 1.5


def test_files(tmp_path):
    scene = lone_sphere("lambert(kd=[0.8, 0.4, 0.2])", [Dome(radiance=1.0)], size=5)
    image = render(scene)
    assert np.array_equal(np.load(image.save(tmp_path / "a.npy")), image.pixels.float().numpy())
    data = image.save(tmp_path / "a.png").read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">II", data[16:24]) == (5, 5)
    size = struct.unpack(">I", data[33:37])[0]
    rows = np.frombuffer(zlib.decompress(data[41 : 41 + size]), np.uint8).reshape(5, 16)[:, 1:].reshape(5, 5, 3)
    assert rows[2, 2].tolist() == [231, 170, 124]  # sRGB of 0.8, 0.4, 0.2
    assert rows[0, 0].tolist() == [255, 255, 255]  # the sky
    with pytest.raises(InvalidValueError, match=r"^Expected the image's file to end in .png, .npy, .exr, got 'a.jpg'"):
        image.save(tmp_path / "a.jpg")


def ramp(width: int = 5, height: int = 3) -> np.ndarray:
    """Pixels of which no two have the same value, some beyond what a half could hold."""
    return np.arange(width * height * 3, dtype=np.float32).reshape(height, width, 3) ** 5


def test_exr_is_what_its_layout_says():
    """Read by what the layout says of attributes, places and lines."""
    data, pixels = exr(ramp()), ramp()
    assert struct.unpack("<ii", data[:8]) == (20000630, 2)
    at, attributes = 8, {}
    while data[at]:
        name, kind, rest = data[at:].split(b"\0", 2)
        size = struct.unpack("<i", rest[:4])[0]
        at += len(name) + len(kind) + 6 + size
        attributes[name.decode()] = data[at - size : at]
    assert struct.unpack("<4i", attributes["dataWindow"]) == (0, 0, 4, 2)
    assert attributes["compression"] == b"\0"
    assert attributes["channels"][:1] + attributes["channels"][18:19] + attributes["channels"][36:37] == b"BGR"
    for y, place in enumerate(struct.unpack("<3Q", data[at + 1 : at + 25])):
        assert struct.unpack("<ii", data[place : place + 8]) == (y, 60)
        line = np.frombuffer(data[place + 8 : place + 68], "<f4").reshape(3, 5)
        assert np.array_equal(line[::-1].T, pixels[y])
    assert len(data) == place + 68


def test_exr_is_read_by_mitsuba(tmp_path):
    mitsuba = pytest.importorskip("mitsuba", reason="needs the renderer Mitsuba 3: pip install -e '.[peers]'")
    mitsuba.set_variant("scalar_rgb")
    image = render(lone_sphere("lambert(kd=[0.8, 0.4, 0.2])", [Dome(radiance=1e6)], size=5))
    for pixels, path in ((image.pixels.float().numpy(), image.save(tmp_path / "a.exr")), (ramp(), tmp_path / "b.exr")):
        path.write_bytes(exr(pixels))
        assert np.array_equal(np.array(mitsuba.Bitmap(str(path))), pixels)


def test_a_plan_of_another_scene():
    one, other = (lone_sphere("lambert", [Dome(radiance=1.0)]) for _ in range(2))
    with pytest.raises(InvalidValueError, match=r"^Expected plan to be of this scene"):
        render(one, plan(other))


@pytest.mark.parametrize("device", ["tpu", "cuda:99", "meta"])
def test_a_device_that_is_not_there(device):
    with pytest.raises(InvalidValueError, match=rf"^Expected device to be cpu, or cuda where .* got '{device}'"):
        render(lone_sphere("lambert", [Dome(radiance=1.0)]), device=device)


def test_everything_leaves_nothing_out():
    chosen = everything(lone_sphere("lambert + kurt", [Dome(radiance=1.0)]), 2)
    assert [effect.name for effect in chosen.effects if not effect.on] == ["albedo look-up", "interreflection 3"]
    assert chosen.depth == 2


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
def test_cuda_gives_the_same_image():
    material = "lambert(kd=0.3) + ggx(isotropic, schlick, f0=0.3, a=0.3)"
    lights = [Dome(radiance=1.0), Directional(direction=(1, 1, 1), irradiance=1.0)]
    objects = [Sphere(material=material, **BALL), Plane(point=(0, 0, -1), material="lambert(kd=0.5)")]
    scene = Scene(camera=camera(), objects=objects, lights=lights, samples=256)
    cpu, cuda = render(scene), render(scene, device="cuda")
    assert cuda.pixels.device.type == "cuda"
    spread = (cpu.noise.square() + cuda.noise.cpu().square()).sqrt()
    assert bool(((cpu.pixels - cuda.pixels.cpu()).abs() <= 5 * spread + 1e-9).all())
