"""The plan: what is on and why, what it bounds, and that nothing which is off is computed."""

import time
from collections import Counter
from statistics import median

import pytest
import torch
from render_cases import BALL, MATERIALS, camera, lone_sphere, random_scene, sidak
from torch.utils._python_dispatch import TorchDispatchMode

import brdfcore as bc
from brdfcore.errors import BrdfError, InvalidValueError
from brdfcore.models.form import Form, Term
from brdfcore.render import Directional, Dome, Plane, Scene, Sphere, SphereLight, everything, plan, render
from brdfcore.render.surfaces import Surface, replaceable, widths

SUN = Directional(direction=(1, 1, 1), irradiance=1.0)
SKY = Dome(radiance=1.0)
LAMP = SphereLight(center=(3, 0, 3), radius=1.0, radiance=1.0)


def on(scene: Scene, **more) -> set[str]:
    return {effect.name for effect in plan(scene, **more).effects if effect.on}


def test_a_lone_convex_object_needs_little():
    always = {"sphere 1: lambert", "sample weights"}
    assert on(lone_sphere("lambert", [SUN])) == always | {"closed form"}
    assert on(lone_sphere("lambert", [SKY])) == always | {"albedo look-up"}
    assert on(lone_sphere("lambert", [LAMP])) == always | {"light sampling"}
    assert on(lone_sphere("ggx", [LAMP])) >= {"light sampling", "brdf sampling", "sphere 1: ggx fresnel"}


def test_several_objects_shade_and_light_each_other():
    objects = [Sphere(name="ball", material="lambert(kd=0.5)", **BALL), Plane(point=(0, 0, -1), material="ggx")]
    scene = Scene(camera=camera(), objects=objects, lights=[SKY])
    found = on(scene)
    assert found >= {"shadow rays", "brdf sampling", "interreflection 1", "ball: lambert", "plane 2: ggx"}
    assert "albedo look-up" not in found
    assert plan(scene, 1e-6).depth > plan(scene, 1e-2).depth > 0


def test_faint_terms_and_needless_options_are_left_out():
    faint = "lambert(kd=0.5) + ggx(isotropic, schlick, ks=0.0005, f0=0.5, a=0.3)"
    chosen = plan(lone_sphere(faint, [SKY]), 1e-3)
    assert not chosen.on("sphere 1: ggx")
    assert 1e-4 < chosen["sphere 1: ggx"].error < 1e-3
    assert chosen.met
    assert plan(lone_sphere(faint, [SKY]), 1e-5).on("sphere 1: ggx")
    assert chosen.on("sphere 1: lambert")
    metal = "ward_bounded(anisotropic, rs=0.5, ax=0.2, ay=0.2) + kurt_plausible(isotropic, schlick, f0=1, m=0.3)"
    chosen = plan(lone_sphere(metal, [SUN]), 0.0)
    assert not chosen.on("sphere 1: ward_bounded anisotropy")
    assert not chosen.on("sphere 1: kurt_plausible fresnel")
    assert chosen.error == 0
    compensated = "ggx(isotropic, constant, ks=1, a=0.02, compensated)"
    assert not plan(lone_sphere(compensated, [SKY]), 1e-2).on("sphere 1: ggx compensation")
    assert plan(lone_sphere(compensated, [SKY]), 1e-6).on("sphere 1: ggx compensation")


def test_what_is_remembered_is_of_these_values():
    """A material that an optimiser has changed is planned anew."""
    scene = lone_sphere("lambert(kd=0.5)", [SKY])
    before = plan(scene)["sphere 1: lambert"].error
    with torch.no_grad():
        next(iter(scene.objects[0].material.parameters())).fill_(0.2)
    assert plan(scene)["sphere 1: lambert"].error < 0.5 * before


@pytest.mark.parametrize("light", [SUN, SKY, LAMP], ids=["sun", "sky", "lamp"])
def test_what_is_left_out_is_bounded(light):
    """Each bound holds, effect by effect: the image with it off differs by no more."""
    lobes = "ggx(isotropic, schlick, ks=0.05, f0=0.2, a=0.4) + ggx(constant, ks=0.05, a=0.6, compensated)"
    scene = lone_sphere(f"lambert(kd=0.02) + {lobes}", [light], size=8)
    everything_on = plan(scene, 1e-4)
    whole = render(scene, everything_on)
    for effect in everything_on.effects:
        if ": " not in effect.name:
            continue
        less = render(scene, plan(scene, 1e-4, {effect.name: False}))
        lost = (whole.pixels - less.pixels).abs()
        noise = 5 * (whole.noise.square() + less.noise.square()).sqrt()
        assert bool((lost <= effect.error + noise + 1e-9).all()), effect.name
        if effect.on and light is not LAMP:  # of which most directions see nothing
            assert float(lost.max()) > 0.5 * effect.error, effect.name


@pytest.mark.parametrize("text", ["ggx(schlick, ks=0.5, f0=0.3, a=0.05)", "ashikhmin_shirley(nu=5, nv=500)"])
def test_what_is_forced_off_is_bounded_as_a_whole(text):
    """Also where a few points, or direct light, were too much already; of an effect that is on, that part is told."""
    scene = lone_sphere(f"lambert(kd=0.3) + {text}", [SUN], size=32)
    first = plan(scene, 1e-6)
    whole = render(scene, first).pixels
    for effect in first.effects:
        if ": " in effect.name:
            chosen = plan(scene, 1e-6, {effect.name: False})
            lost = float((whole - render(scene, chosen).pixels).abs().max())
            assert lost <= chosen.error * (1 + 1e-9), effect.name
            assert not chosen[effect.name].partial
            assert effect.partial
    assert "> " in next(line for line in str(first).splitlines() if line.startswith("sphere 1: lambert"))
    objects = [*scene.objects, Plane(point=(0, 0, -1), material="lambert(kd=0.8)")]
    among = Scene(camera=camera(), objects=objects, lights=[SKY])
    name = "sphere 1: lambert"
    first, chosen = plan(among, 1e-4), plan(among, 1e-4, {name: False})
    assert first[name].partial
    assert chosen[name].error > 1.5 * first[name].error


def test_force_and_its_errors():
    scene = lone_sphere("lambert", [SKY])
    chosen = plan(scene, force={"sphere 1: lambert": False, "shadow rays": True})
    assert not chosen.on("sphere 1: lambert")
    assert chosen["shadow rays"].on
    assert chosen["shadow rays"].forced
    assert not chosen.met
    assert float(render(scene, chosen).pixels.min()) == 0
    with pytest.raises(BrdfError, match=r"^Expected an effect to be a known name, got 'shadows'\."):
        plan(scene, force={"shadows": True})
    with pytest.raises(InvalidValueError, match=r"^Expected light sampling or brdf sampling to be on, got both"):
        plan(scene, force={"albedo look-up": False, "brdf sampling": False})
    floor = Plane(point=(0, 0, -1), material=scene.objects[0].material)
    pair = Scene(camera=scene.camera, objects=[*scene.objects, floor], lights=[SKY])
    for made, force in ((pair, {}), (scene, {"sample weights": False})):
        with pytest.raises(
            InvalidValueError,
            match=r"^Expected albedo look-up to be off where there are several objects or uniform weights",
        ):
            plan(made, force={"albedo look-up": True} | force)
    with pytest.raises(InvalidValueError, match=r"^Expected tolerance to be a finite number from 0, got -1\."):
        plan(scene, -1.0)
    with pytest.raises(InvalidValueError, match=r"^Expected tolerance to be a finite number from 0, got 'low'\."):
        plan(scene, "low")
    with pytest.raises(InvalidValueError, match=r"^Expected force of 'shadow rays' to be True or False, got 'off'\."):
        plan(scene, force={"shadow rays": "off"})


def test_the_table_says_it_all():
    text = str(plan(lone_sphere("lambert + ggx", [SKY, SUN])))
    assert "sphere 1: ggx fresnel" in text
    assert "one convex object casts no shadow on itself" in text
    assert text.splitlines()[-1] == "left out: at most 0.0e+00, within the tolerance 0.001"
    endless = Scene(
        camera=camera(),
        objects=[Sphere(material="lambert(kd=1)", **BALL), Plane(point=(0, 0, -1), material="lambert(kd=1)")],
        lights=[SKY],
    )
    chosen = plan(endless, bounces=2)
    assert not chosen.met
    assert "unbounded" in str(chosen).splitlines()[-1]
    assert chosen["interreflection 3"].reason == "beyond the limit of 2 bounces"
    assert chosen.cost > plan(endless, force={"interreflection 1": False}).cost > 0


def test_what_is_no_bound_is_told_as_an_estimate():
    """Caustics of lights without extent are as bright as they like; diffuse surfaces have none."""
    for material, word, flag in (("ggx(ks=0.5)", "about", True), ("lambert(kd=0.5)", "at most", False)):
        objects = [Sphere(material=material, **BALL), Plane(point=(0, 0, -1), material="lambert(kd=0.3)")]
        chosen = plan(Scene(camera=camera(), objects=objects, lights=[SUN]), 1e-2)
        last = [effect for effect in chosen.effects if effect.bounce][-1]
        assert (last.on, last.estimated) == (False, flag)
        assert str(chosen).splitlines()[-1].startswith(f"left out: {word} {chosen.error:.1e}")
        assert ("~ " in str(chosen)) == flag


def test_a_bounce_that_is_forced_brings_those_before_it():
    objects = [Sphere(material="lambert(kd=0.5)", **BALL), Plane(point=(0, 0, -1), material="lambert(kd=0.5)")]
    scene = Scene(camera=camera(), objects=objects, lights=[SKY])
    assert plan(scene, 0.5).depth < 5
    chosen = plan(scene, 0.5, {"interreflection 5": True})
    assert chosen.depth == 5
    assert [effect.forced for effect in chosen.effects if effect.bounce] == [False] * 4 + [True, False]
    with pytest.raises(BrdfError, match=r"^Expected an effect to be a known name, got 'interreflection 5'\."):
        plan(scene, 0.5, {"interreflection 5": True, "interreflection 2": False})


def test_two_objects_of_one_name_have_two_rows():
    objects = [Sphere(name="ball", material="lambert", center=(0, k, 0), radius=0.4) for k in (0, 1)]
    chosen = plan(Scene(camera=camera(), objects=objects, lights=[SKY]))
    assert {"ball 1: lambert", "ball 2: lambert"} <= {effect.name for effect in chosen.effects}


def test_names_are_told_from_numbers_and_from_interreflections():
    """An object may have the name that another gets, or that of an effect."""
    names = ("", "sphere 1", "interreflection 1")
    objects = [
        Sphere(name=name, material=f"lambert(kd=0.{k + 1})", center=(0, k, 0), radius=0.4)
        for k, name in enumerate(names)
    ]
    chosen = plan(Scene(camera=camera(), objects=objects, lights=[SKY]), bounces=1)
    terms = [effect for effect in chosen.effects if effect.name.endswith(": lambert")]
    assert [effect.name for effect in terms] == [
        "sphere 1: lambert",
        "sphere 1 2: lambert",
        "interreflection 1: lambert",
    ]
    assert len({effect.error for effect in terms}) == 3
    assert [effect.name for effect in chosen.effects if effect.bounce] == ["interreflection 1", "interreflection 2"]
    force = {effect.name: False for effect in terms}
    black = plan(chosen.scene, force=force, bounces=1)
    assert black.error >= sum(effect.error for effect in terms)


class Counted(TorchDispatchMode):
    """Counts the operations on rays: those that make more numbers than a material has values."""

    def __init__(self) -> None:
        super().__init__()
        self.seen: Counter[str] = Counter()

    def __torch_dispatch__(self, func, types, args=(), kwargs=None):
        result = func(*args, **(kwargs or {}))
        if isinstance(result, torch.Tensor) and result.numel() > 3:
            self.seen[str(func)] += 1
        return result


def operations(scene: Scene, **more) -> Counter[str]:
    chosen = plan(scene, **more)
    render(scene, chosen)  # what a process reads once
    with Counted() as counted:
        render(scene, chosen)
    return counted.seen


@pytest.mark.parametrize("light", [SUN, LAMP], ids=["sun", "lamp"])
@pytest.mark.parametrize(
    ("has", "lacks"),
    [
        ("ggx(constant, ks=0.3, a=0.3) + lambert(kd=0)", "ggx(constant, ks=0.3, a=0.3)"),
        ("lambert(kd=0.3) + ward_bounded(rs=0)", "lambert(kd=0.3)"),
        ("ggx(isotropic, schlick, ks=0.3, f0=0.00001, a=0.3) + lambert", "ggx(schlick, f0=0.00001) + lambert"),
    ],
)
def test_what_is_off_adds_no_operation(has, lacks, light):
    """The image of a material with absent parts takes the operations of the material without them."""
    more = {"force": {"brdf sampling": True, "light sampling": True}} if light is LAMP else {}
    scenes = [lone_sphere(material, [light], samples=4) for material in (has, lacks)]
    mine, other = (operations(scene, **more) for scene in scenes)
    assert mine == other
    assert mine.total() > 50


def test_no_rays_among_lone_objects(monkeypatch):
    """A lone convex object is met by the camera's rays only."""
    scene = lone_sphere("lambert(kd=0.5) + ggx", [LAMP, SUN], samples=8)
    chosen = plan(scene)
    calls = []
    original = Sphere.hit
    monkeypatch.setattr(Sphere, "hit", lambda self, o, d: calls.append(len(o)) or original(self, o, d))
    render(scene, chosen)
    assert calls == [144, 144]  # for what is exact, and for one pass of samples
    calls.clear()
    render(scene, plan(scene, force={"shadow rays": True}))
    assert len(calls) > 2


CHOICES = [choice for model in bc.MODELS.values() for choice in model.choices() if replaceable(choice)]


@pytest.mark.parametrize("choice", CHOICES, ids=lambda choice: f"{choice.name}({','.join(choice.options)})")
def test_simpler_terms_are_the_same_where_what_they_lack_has_no_effect(choice, generator):
    """Every word that can be replaced, in every model: equal widths, and a Fresnel factor of 1."""
    values = {name: p.default for name, p in choice.parameter.items()} | (
        {"f0": 1.0} if "f0" in choice.parameter else {}
    )
    own = {name: torch.tensor(value) for name, value in values.items()}
    words = [word for word in replaceable(choice) if word != "compensated"]
    if "anisotropic" in words and widths(choice, own) is None:
        words.remove("anisotropic")
    names = [name for name in values if name not in type(choice)(["isotropic"]).parameter]
    for name in names[1:]:
        values[name] = values[names[0]]
    form = Form((Term(choice.name, choice),))
    material = bc.Material(form, {f"{choice.name}.{name}": value for name, value in values.items()})
    whole = Surface(material)
    less = Surface(material, simpler={choice.name: frozenset(words)})
    wi, wo = (torch.randn(50, 3, generator=generator, dtype=torch.float64) for _ in range(2))
    wi, wo = (torch.nn.functional.normalize(w.abs(), dim=-1) for w in (wi, wo))
    torch.testing.assert_close(less.reflected(wi, wo), whole.reflected(wi, wo), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("text", ["ggx(schlick, f0=0.4)", "ashikhmin_shirley(f0=0.4)", "kurt(schlick, ks=0.7, f0=0.4)"])
def test_without_fresnel_the_reflectance_is_that_at_normal_incidence(text):
    """Where the directions meet, Schlick's factor is f0."""
    material = bc.material(text)
    label = material.form.terms[0].label
    less = Surface(material, simpler={label: frozenset({"schlick"})})
    up = torch.tensor([[0.0, 0.0, 1.0]], dtype=torch.float64)
    torch.testing.assert_close(less.reflected(up, up), Surface(material).reflected(up, up))
    assert "constant" in less.form.terms[0].model.options


def compare(seed: int, tolerance: float = 0.01, bounces: int = 4) -> tuple[float, float, float]:
    """The largest difference to everything beyond the tolerance, of a pixel or of the image's mean, in standard errors.

    The others are the times of both images.
    """
    scene = random_scene(seed)
    planned, whole = plan(scene, tolerance, bounces=bounces), everything(scene, bounces)
    images = []
    for chosen in (planned, whole):
        start = time.perf_counter()
        images.append((render(scene, chosen, seed=seed), time.perf_counter() - start))
    (mine, quick), (other, slow) = images
    noise = (mine.noise.square() + other.noise.square()).sqrt()
    difference, count = mine.pixels - other.pixels, noise[..., 0].numel()
    pixel = (difference.abs() - tolerance) / noise.clamp(min=1e-6)
    mean = (difference.mean((0, 1)).abs() - tolerance) / (noise.square().sum((0, 1)).sqrt() / count).clamp(min=1e-6)
    return max(float(pixel.max()), float(mean.max())), quick, slow


# 64 samples of skewed weights: their means are no normal deviates, which the level leaves room for
@pytest.mark.parametrize("count", [5, pytest.param(50, marks=pytest.mark.full)])
def test_planned_images_are_those_of_everything(count):
    found = [compare(seed) for seed in range(count)]
    assert max(z for z, _, _ in found) < 1.5 * sidak(count * 8 * 8 * 3)
    ratio = median(slow / quick for _, quick, slow in found)
    print(f"everything takes {ratio:.1f} times as long as planned, the median of {count} scenes")
    assert ratio > 1 or count < 50  # few small images say little


def test_random_scenes_hold_every_material():
    """The test of the tests: the scenes above are not all alike."""
    names = {
        term.model.name
        for seed in range(50)
        for shape in random_scene(seed).objects
        for term in shape.material.form.terms
    }
    assert len(names) >= len(MATERIALS)
