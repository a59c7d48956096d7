"""Gradients of images by materials' parameters and lights' strengths, against finite differences."""

import pytest
import torch
from render_cases import BALL, camera, lone_sphere

import brdfcore as bc
from brdfcore.render import Directional, Dome, Plane, RectangleLight, Scene, Sphere, plan, render

TEXT = "lambert(kd={kd}) + ggx(isotropic, schlick, ks={ks}, f0={f0}, a={a})"
VALUES = {"kd": 0.3, "ks": 0.5, "f0": 0.3, "a": 0.3}
LIGHTS = {
    "closed form": Directional(direction=(1, 1, 1), irradiance=2.0),
    "albedo look-up": Dome(radiance=1.0),
    "light sampling": RectangleLight(center=(3, 0, 3), edge_u=(0, 2, 0), edge_v=(1, 0, -1), radiance=4.0),
}
TARGET = torch.linspace(0, 1, 64, dtype=torch.float64).reshape(8, 8, 1)  # so that no pixel counts as another


def loss(scene: Scene, **more) -> torch.Tensor:
    return (render(scene, **more).pixels * TARGET).sum()


@pytest.mark.parametrize("name", LIGHTS)
def test_gradients_are_the_finite_differences_with_the_same_random_numbers(name):
    """By every value of the material, in closed form and for samples of a light: these do not move with it."""

    def scene(**changed: float) -> Scene:
        return lone_sphere(TEXT.format(**(VALUES | changed)), [LIGHTS[name]], size=8, samples=8)

    def chosen(made: Scene):
        return plan(made, 1e-9, {"brdf sampling": False})

    base = scene()
    loss(base, plan=chosen(base), gradient=True).backward()
    values, material = base.objects[0].material.values(), base.objects[0].material
    for key, step in (("lambert.kd", 1e-4), ("ggx.ks", 1e-4), ("ggx.f0", 1e-4), ("ggx.a", 1e-4)):
        label, short = key.split(".")
        raw = material.raw[label][short].grad
        natural = raw / values[key].detach() if material.form.parameters[key].scale == "log" else raw
        ends = []
        for sign in (1, -1):
            made = scene(**{short: VALUES[short] + sign * step})
            ends.append(float(loss(made, plan=chosen(made))))
        assert float(natural) == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-4), key
        assert abs(float(natural)) > 1e-3


def test_gradients_by_material_samples_are_right_in_the_mean():
    """Samples that would move with the roughness are held: right in the mean, edges of lights and shadows included."""
    text = "ggx(isotropic, constant, ks=0.8, a={a})"
    objects = [Plane(point=(0, 0, -1), material="lambert(kd=0.3)")]

    def scene(a: float) -> Scene:
        ball = Sphere(material=text.format(a=a), **BALL)
        return Scene(camera=camera(6), objects=[ball, *objects], lights=[Dome(radiance=1.0)], samples=256)

    def total(made: Scene, seed: int, **more) -> torch.Tensor:
        chosen = plan(made, 1e-2, bounces=1)
        return render(made, chosen, seed=seed, **more).pixels.sum()

    gradients, differences = [], []
    for seed in range(4):
        base = scene(0.6)
        total(base, seed, gradient=True).backward()
        gradients.append(float(base.objects[0].material.raw["ggx"]["a"].grad) / 0.6)
        differences.append(float(total(scene(0.63), seed) - total(scene(0.57), seed)) / 0.06)
    found, expected = (torch.tensor(x) for x in (gradients, differences))
    spread = float(((found.var() + expected.var()) / 4).sqrt())
    assert abs(float(found.mean() - expected.mean())) < 4 * spread
    assert abs(float(expected.mean())) > 8 * spread  # and it is no zero


def test_gradient_by_a_lights_strength():
    strength = torch.tensor([1.0, 2.0, 3.0], requires_grad=True, dtype=torch.float64)
    scene = lone_sphere("lambert(kd=0.5)", [Directional(direction=(1, 0, 1), irradiance=strength)], size=8)
    pixels = render(scene, gradient=True).pixels
    pixels.sum((0, 1))[1].backward()
    expected = pixels.detach().sum((0, 1))[1] / 2
    torch.testing.assert_close(strength.grad, torch.stack([0 * expected, expected, 0 * expected]))
    assert not render(scene).pixels.requires_grad


def test_a_roughness_is_found_by_descent():
    """What gradients are for: the material of an image."""
    seen = render(lone_sphere("ward_bounded(isotropic, rs=0.5, a=0.3)", [LIGHTS["closed form"]], size=8)).pixels
    scene = lone_sphere("ward_bounded(isotropic, rs=0.4, a=0.4)", [LIGHTS["closed form"]], size=8)
    material, chosen = scene.objects[0].material, plan(scene, 0.0)
    optimiser = torch.optim.LBFGS(material.parameters(), max_iter=30, line_search_fn="strong_wolfe")

    def step() -> torch.Tensor:
        optimiser.zero_grad()
        value = (render(scene, chosen, gradient=True).pixels - seen).square().sum()
        value.backward()
        return value

    optimiser.step(step)
    assert float(material.values()["ward_bounded.a"].detach()) == pytest.approx(0.3, rel=1e-3)
    assert str(bc.material(str(material))) == str(material)
