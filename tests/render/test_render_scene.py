"""Scenes: their JSON, and the sentence for each that cannot be."""

import json

import pytest
import torch
from render_cases import BALL, camera, random_scene

import brdfcore as bc
from brdfcore.errors import BrdfError, FormatError, InvalidValueError
from brdfcore.render import Dome, Plane, Rectangle, Scene, Sphere, SphereLight

GOOD = {
    "camera": {"position": [3, 0, 1], "look_at": [0, 0, 0], "width": 4, "height": 4},
    "objects": [{"kind": "sphere", "center": [0, 0, 0], "radius": 1, "material": "lambert(kd=0.5)"}],
    "lights": [{"kind": "dome", "radiance": 1}],
}


def changed(path: str, value: object) -> dict:
    """The good scene with one entry replaced, or removed where the value is ...."""
    data = json.loads(json.dumps(GOOD))
    *folders, last = [int(key) if key.isdigit() else key for key in path.split("/")]
    place = data
    for key in folders:
        place = place[key]
    if value is ...:
        del place[last]
    else:
        place[last] = value
    return data


@pytest.mark.parametrize("seed", range(8))
def test_json_round_trip(seed):
    """The JSON of a scene gives the same JSON again, through text; and the same image."""
    scene = random_scene(seed, samples=2)
    text = json.dumps(scene.to_json(), allow_nan=False)
    again = Scene.from_json(json.loads(text))
    assert json.dumps(again.to_json()) == text
    images = [bc.render.render(s, bc.render.plan(s, 0.5, bounces=1)).pixels for s in (scene, again)]
    assert torch.equal(*images)


def test_one_text_is_one_material():
    data = changed(
        "objects", [GOOD["objects"][0], {"kind": "plane", "point": [0, 0, -1], "material": "lambert(kd=0.5)"}]
    )
    scene = Scene.from_json(data)
    assert scene.objects[0].material is scene.objects[1].material


def test_a_file_is_read_and_a_wrong_one_told(tmp_path):
    (tmp_path / "good.json").write_text(json.dumps(GOOD))
    assert Scene.load(tmp_path / "good.json").camera.width == 4
    (tmp_path / "bad.json").write_text("{")
    with pytest.raises(InvalidValueError, match=r"^Expected bad.json to be JSON, got: .*Correct it there\.$"):
        Scene.load(tmp_path / "bad.json")
    (tmp_path / "deep.json").write_text("[" * 10**5)
    with pytest.raises(InvalidValueError, match=r"^Expected deep.json to be JSON, got: maximum recursion depth"):
        Scene.load(tmp_path / "deep.json")
    with pytest.raises(FormatError, match=r"^Expected scene to be a readable file, got 'none.json' \(No such file"):
        Scene.load(tmp_path / "none.json")
    with pytest.raises(BrdfError, match=r"^Expected a scene to be a known name, got 'furnance'"):
        Scene.load("furnance")


BAD = {
    "no light": ("lights", [], "lights", "Expected lights to hold at least one light, got none. Add one."),
    "no object": ("objects", [], "objects", "Expected objects to hold at least one object, got none. Add one."),
    "a dark light": ("lights/0/radiance", 0, "lights", "Expected one of the lights to shine"),
    "a negative light": ("lights/0/radiance", -1, "lights[0].radiance", "finite, not negative and up to 1e30, got -1"),
    "a light of two channels": ("lights/0/radiance", [1, 2], "lights[0].radiance", "to be one number or three"),
    "camera inside": (
        "camera/position",
        [0.5, 0, 0],
        "camera.position",
        "Expected camera.position to be outside of objects[0], got [0.5, 0.0, 0.0]",
    ),
    "negative size": (
        "objects/0/radius",
        -1,
        "objects[0].radius",
        "Expected objects[0].radius to be a finite number above 0 and up to 1e30, got -1. Give it a size.",
    ),
    "infinite size": ("objects/0/radius", float("inf"), "objects[0].radius", "got inf"),
    "unknown material": ("objects/0/material", "lambart", "objects[0].material", "Did you mean 'lambert'?"),
    "material of five channels": (
        "objects/0/material",
        "lambert(kd=[0.1, 0.2, 0.3, 0.4, 0.5])",
        "objects[0].material",
        "to have 1 or 3 channels, got 5",
    ),
    "no material": ("objects/0/material", ..., "objects[0].material", "Expected objects[0].material to be given"),
    "a center of two numbers": (
        "objects/0/center",
        [0, 0],
        "objects[0].center",
        "three finite numbers, none beyond 1e30, got [0, 0]",
    ),
    "no direction": ("objects/0/tangent", [0, 0, 0], "objects[0].tangent", "a direction, got a vector of length 0"),
    "a name that is a number": ("objects/0/name", 3, "objects[0].name", "Expected objects[0].name to be a text, got 3"),
    "an unknown kind": ("objects/0/kind", "cube", "objects[0].kind", "got 'cube'. Known: sphere, plane, rectangle"),
    "no kind": ("objects/0/kind", ..., "objects[0].kind", "to be one of sphere, plane, rectangle"),
    "an unknown field": ("camera/fov", 3, "camera.fov", "Did you mean 'fov_deg'?"),
    "wide camera": ("camera/fov_deg", 180, "camera.fov_deg", "above 0 and below 180, got 180"),
    "no pixels": ("camera/width", 0, "camera.width", "a whole number from 1 to 16384, got 0"),
    "an enormous edge": ("camera/height", 10**6, "camera.height", "a whole number from 1 to 16384, got 1000000"),
    "an enormous image": (
        "camera",
        GOOD["camera"] | {"width": 16384, "height": 16384},
        "camera.width",
        "to be at most 16,777,216 rays, got 268,435,456. Lower the grid",
    ),
    "a place that is no number": ("camera/position", [float("nan"), 0, 1], "camera.position", "three finite numbers"),
    "a size beyond arithmetic": ("objects/0/radius", 1e200, "objects[0].radius", "up to 1e30, got 1e+200"),
    "a size that is no number": ("objects/0/radius", float("nan"), "objects[0].radius", "up to 1e30, got nan"),
    "a light that is no number": (
        "lights/0/radiance",
        float("nan"),
        "lights[0].radiance",
        "not negative and up to 1e30, got nan",
    ),
    "a reflectance that is no number": ("objects/0/material", "lambert(kd=nan)", "objects[0].material", "kd"),
    "camera looks nowhere": ("camera/look_at", [3, 0, 1], "camera.look_at", "to differ from position"),
    "camera looks up": ("camera/look_at", [3, 0, 2], "camera.look_at", "and not along up"),
    "samples": ("samples", 0, "samples", "Expected samples to be a whole number from 1"),
    "noise": ("noise", -1, "noise", "Expected noise to be a finite number above 0 and up to 1e30, got -1"),
    "exposure": ("exposure", 0, "exposure", "Expected exposure to be a finite number above 0 and up to 1e30, got 0"),
    "objects of another type": ("objects", 3, "objects", "Expected objects to be a list, got 3"),
    "camera of another type": ("camera", 3, "camera", "Expected camera to be an object, got 3"),
    "a light of zero area": (
        "lights/0",
        {"kind": "rectangle", "center": [0, 0, 3], "edge_u": [1, 0, 0], "edge_v": [0, 0, 0], "radiance": 1},
        "lights[0].edge_u",
        "to span an area above 0, got [1.0, 0.0, 0.0] and [0.0, 0.0, 0.0]",
    ),
    "a light of radius 0": (
        "lights/0",
        {"kind": "sphere", "center": [0, 0, 3], "radius": 0, "radiance": 1},
        "lights[0].radius",
        "Expected lights[0].radius to be a finite number above 0 and up to 1e30, got 0",
    ),
    "an oblique light": (
        "lights/0",
        {"kind": "rectangle", "center": [0, 0, 3], "edge_u": [1, 0, 0], "edge_v": [1, 1, 0], "radiance": 1},
        "lights[0].edge_v",
        "at right angles to edge_u",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_scene_is_one_sentence_with_the_field(case):
    path, value, field, sentence = BAD[case]
    with pytest.raises(BrdfError) as caught:
        Scene.from_json(changed(path, value))
    assert sentence in caught.value.message
    assert caught.value.field == field
    assert "\n" not in caught.value.message


def test_a_scene_of_wrong_parts():
    ball = Sphere(material="lambert", **BALL)
    with pytest.raises(InvalidValueError, match=r"^Expected objects to be a sequence of Shapes, got"):
        Scene(camera=camera(), objects=[Dome(radiance=1)], lights=[Dome(radiance=1)])
    with pytest.raises(InvalidValueError, match=r"^Expected lights to be a sequence of Lights, got"):
        Scene(camera=camera(), objects=[ball], lights=[ball])
    with pytest.raises(InvalidValueError, match=r"^Expected camera to be a Camera, got 3\."):
        Scene(camera=3, objects=[ball], lights=[Dome(radiance=1)])
    with pytest.raises(InvalidValueError, match=r"^Expected material to be a Material, got int"):
        Sphere(material=3, **BALL)
    with pytest.raises(InvalidValueError, match=r"^Expected camera.position to be outside of objects\[0\]"):
        Scene(camera=camera(position=(1, 0, -1)), objects=[Plane(material="lambert")], lights=[Dome(radiance=1)])


def test_inside_and_distances():
    ball = Sphere(material="lambert", center=(0, 0, 1), radius=0.5)
    floor = Plane(material="lambert")
    wall = Rectangle(material="lambert", center=(0, 0, 0), edge_u=(2, 0, 0), edge_v=(0, 2, 0))
    assert [shape.contains((0, 0, 1.2)) for shape in (ball, floor, wall)] == [True, False, False]
    assert [shape.distance((0, 0, 3)) for shape in (ball, floor, wall)] == pytest.approx([1.5, 3, 3])
    light = SphereLight(center=(0, 0, 0), radius=2, radiance=1)
    inside = torch.zeros(1, 3, dtype=torch.float64)
    up = torch.tensor([[0.0, 0.0, 1.0]], dtype=torch.float64)
    assert [float(x) for x in light.met(inside, up, up)] == pytest.approx([2, 1 / (4 * torch.pi)])


@pytest.mark.parametrize("length", [1e-6, 1.0, 1e20])
def test_rectangles_of_any_size_face_one_side(length):
    """As large as numbers may be, and as small: the normal is of unit length."""
    wall = Rectangle(material="lambert", center=(0, 0, 0), edge_u=(length, 0, 0), edge_v=(0, length, 0))
    origin = torch.tensor([[0.0, 0.0, 1.0]], dtype=torch.float64)
    assert wall.normal(origin).tolist() == origin.tolist()
    assert wall.hit(origin, -origin).tolist() == [1.0]


def test_the_materials_x_axis_runs_along_the_tangent():
    """Up a sphere's meridians, along a plane's x and a rectangle's first edge, unless a tangent is given; y follows."""
    ball = Sphere(material="lambert", center=(0, 0, 0), radius=1)
    turned = Sphere(material="lambert", center=(0, 0, 0), radius=1, tangent=(3, 2, 0))
    wall = Rectangle(material="lambert", center=(0, 0, 0), edge_u=(0, 2, 0), edge_v=(0, 0, 2))
    for shape, point, x, y in (
        (ball, [1, 0, 0], [0, 0, 1], [0, -1, 0]),
        (turned, [1, 0, 0], [0, 1, 0], [0, 0, 1]),
        (wall, [0, 0, 0], [0, 1, 0], [0, 0, 1]),
        (Plane(material="lambert"), [0, 0, 0], [1, 0, 0], [0, 1, 0]),
    ):
        at = torch.tensor([point], dtype=torch.float64)
        axes = shape.frame(shape.normal(at))
        assert [axis[0].tolist() for axis in axes[:2]] == [x, y]
