"""Measured tables as materials of a scene: their images, what the plan says of them, and their JSON."""

import dataclasses
import json

import pytest
import torch
from render_cases import BALL, albedos, camera, lone_sphere, sidak

import brdfcore as bc
from brdfcore.errors import BrdfError, FormatError, InvalidValueError
from brdfcore.formats import merl
from brdfcore.render import Directional, Dome, Plane, RectangleLight, Scene, Sphere, everything, plan, render

TEXT = "lambert(kd=[0.3, 0.2, 0.1]) + ward_bounded(isotropic, rs=0.3, a=0.3)"
SHAPE = (45, 30, 60)
LAMP = RectangleLight(center=(3, 0, 3), edge_u=(0, 2, 0), edge_v=(1, 0, -1), radiance=4.0)


@pytest.fixture
def folder(monkeypatch, tmp_path):
    """A folder with a material as a small table, `paint.binary`."""
    monkeypatch.setattr(merl, "SHAPE", SHAPE)
    bc.export(bc.material(TEXT), "merl", tmp_path / "paint.binary")
    return tmp_path


@pytest.fixture
def table(folder) -> bc.Tabulated:
    return bc.Tabulated.read(folder / "paint.binary")


def test_furnace(table):
    """Every pixel of a lone sphere under an even sky is the table's albedo, by its own samples."""
    scene = lone_sphere(table, [Dome(radiance=1.0)], size=6, samples=512)
    image = render(scene, tolerance=1e-3)
    rows, expected = albedos(scene, tolerance=1e-3)
    pixels, noise = (x.reshape(-1, 3)[rows] for x in (image.pixels, image.noise))
    assert bool(((pixels - expected).abs() <= sidak(pixels.numel()) * noise + 1e-3).all())
    assert 0 < float(noise.max()) < 0.03
    assert image.samples == 512


@pytest.mark.parametrize("light", [LAMP, Directional(direction=(1, 0.2, 1), irradiance=2.0)], ids=["lamp", "sun"])
def test_a_material_and_its_table_look_the_same(table, light):
    """With a floor, shadows and interreflections; to what the table's few nodes lose."""
    images = []
    for material in (bc.material(TEXT), table):
        objects = [Sphere(material=material, **BALL), Plane(point=(0, 0, -1), material="lambert(kd=0.5)")]
        scene = Scene(camera=camera(10), objects=objects, lights=[light, Dome(radiance=0.1)], samples=64)
        images.append(render(scene, plan(scene, 1e-2, bounces=2)))
    noise = (images[0].noise.square() + images[1].noise.square()).sqrt()
    off = (images[0].pixels - images[1].pixels).abs()
    assert bool((off <= sidak(off.numel()) * 1.5 * noise + 0.05 * images[0].pixels + 1e-3).all())
    assert abs(float((images[0].pixels - images[1].pixels).mean())) < 0.02 * float(images[0].pixels.mean())


def test_what_the_plan_says(table):
    """Light without an extent is bounded, what is summed over directions is estimated; the table can be left out."""
    sun = lone_sphere(table, [Directional(direction=(1, 1, 1), irradiance=1e-5)])
    assert not plan(sun, 1e-3).on("sphere 1: measured")
    assert 0 < plan(sun, 1e-3).error < 1e-4
    sky = lone_sphere(table, [Dome(radiance=1.0)])
    chosen = plan(sky)
    assert "estimated by samples, not bounded" in chosen["sphere 1: measured"].reason
    assert 0.5 < chosen["sphere 1: measured"].error < 1
    assert chosen["albedo look-up"].reason == "a table is only sampled"
    assert chosen.on("brdf sampling")
    assert not render(sky, plan(sky, force={"sphere 1: measured": False})).pixels[6, 6].any()
    objects = [Sphere(material=table, **BALL), Plane(point=(0, 0, -1), material="lambert(kd=0.5)")]
    floor = Scene(camera=camera(), objects=objects, lights=[Dome(radiance=1.0)])
    assert plan(floor)["interreflection 1"].reason.endswith(", estimated for a table")
    assert everything(sky).on("sphere 1: measured")


@pytest.mark.parametrize(("name", "on"), [("sample weights", False), ("albedo look-up", True)])
def test_what_a_table_does_not_have_cannot_be_forced(table, name, on):
    scene = lone_sphere(table, [Dome(radiance=1.0)])
    with pytest.raises(InvalidValueError, match=rf"^Expected {name} to be .* where a material is measured, got it"):
        plan(scene, force={name: on})


def test_json_names_the_file(folder, table):
    """Relative to the scene's file; as it is written, absolute; and one file is one material."""
    data = lone_sphere("lambert", [LAMP]).to_json()
    data["objects"][0]["material"] = {"measured": "paint.binary"}
    data["objects"].append({"kind": "plane", "point": [0, 0, -2], "material": {"measured": "paint.binary"}})
    (folder / "scene.json").write_text(json.dumps(data))
    scene = Scene.load(folder / "scene.json")
    assert scene.objects[0].material is scene.objects[1].material
    assert scene.channels == 3
    up = torch.tensor([[0.0, 0.0, 1.0]], dtype=torch.float64)
    assert torch.equal(scene.objects[0].material.f(up, up), table.f(up, up))
    again = Scene.from_json(json.loads(json.dumps(scene.to_json())), folder="elsewhere")
    assert again.to_json() == scene.to_json()
    made = dataclasses.replace(scene.objects[0], material=bc.lawrence(table, outer=1, inner=1))
    with pytest.raises(InvalidValueError, match=r"^Expected a table that was read from a file, got paint.binary, fac"):
        dataclasses.replace(scene, objects=[made]).to_json()


@pytest.mark.parametrize(
    ("given", "place", "kind", "sentence"),
    [
        ({"measured": "paint.binary"}, None, InvalidValueError, "no measured file in a scene that is no file itself"),
        ({"measured": "none.binary"}, "", FormatError, "Expected path to be a readable file, got 'none.binary'"),
        ({"measured": 3}, "", InvalidValueError, "to be a file's path and no more, got {'measured': 3}"),
        ({"measured": "paint.binary", "kd": 1}, "", InvalidValueError, "to be a file's path and no more"),
        ({"measured": "scene.txt"}, "", FormatError, "objects[0].material: "),
    ],
)
def test_mistakes_are_one_sentence(folder, given, place, kind, sentence):
    (folder / "scene.txt").write_text("no table")
    data = lone_sphere("lambert", [LAMP]).to_json()
    data["objects"][0]["material"] = given
    with pytest.raises(BrdfError) as caught:
        Scene.from_json(data, None if place is None else folder / place)
    assert type(caught.value) is kind
    assert sentence in caught.value.message
    assert caught.value.field == "objects[0].material"


def test_a_real_table_renders(measured):
    """A file of the RGL database, extrapolated towards the horizon as it is."""
    scene = lone_sphere(bc.Tabulated.read(measured / "rgl" / "vch_silk_blue_rgb.bsdf"), [LAMP], size=8, samples=16)
    pixels = render(scene).pixels
    assert bool(pixels.isfinite().all())
    assert float(pixels.max()) > 0.05
