"""The lit sphere against the renderer, and the colours of spectra."""

import torch

import brdfcore as bc
from brdfcore.render import Camera, Scene, Sphere, lit_sphere, render, to_rgb
from brdfcore.render.sphere import DISTANCE, FOV, LAMPS


def test_a_lit_sphere_is_what_the_renderer_makes_of_its_scene() -> None:
    material = bc.material("lambert(kd=[0.5, 0.2, 0.1]) + ggx(anisotropic, f0=0.3, ax=0.1, ay=0.4)")
    camera = Camera(position=(DISTANCE, 0, 0), look_at=(0, 0, 0), width=20, height=20, fov_deg=FOV)
    scene = Scene(camera=camera, objects=(Sphere(center=(0, 0, 0), radius=1, material=material),), lights=LAMPS)
    made = lit_sphere(material, 20)
    torch.testing.assert_close(made, render(scene, tolerance=0).pixels, rtol=1e-9, atol=1e-12)
    assert float(made.detach().max()) > 0.5
    made.sum().backward()  # type: ignore[no-untyped-call]
    assert all(p.grad is not None for p in material.parameters())


def test_a_diffuser_has_the_brightness_that_is_said() -> None:
    with torch.no_grad():
        image = lit_sphere(bc.material("lambert(kd=1)"), 161)
    assert 0.89 < float(image.max()) < 1.0


def test_a_spectrum_has_the_colour_that_it_is_seen_in() -> None:
    names = [str(400 + 10 * k) for k in range(31)]
    nm = torch.arange(400, 701, 10, dtype=torch.float64)
    for low, high, brightest in ((610, 700, 0), (520, 560, 1), (430, 470, 2)):
        rgb = to_rgb(((nm >= low) & (nm <= high)).double(), names)
        assert rgb is not None
        assert int(rgb.argmax()) == brightest
        assert float(rgb.min()) >= 0
    backwards = to_rgb(nm.flip(0) / 700, names[::-1])
    torch.testing.assert_close(backwards, to_rgb(nm / 700, names))
    three = torch.rand(4, 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    assert torch.equal(to_rgb(three, ["r", "g", "b"]), three)  # type: ignore[arg-type]
    assert to_rgb(torch.rand(4, 5), list("abcde")) is None
    assert to_rgb(torch.ones(4, 1), ["value"]).shape == (4, 3)  # type: ignore[union-attr]
    assert to_rgb(torch.ones(4, 2), ["500", "600"]) is None, "two wavelengths make no colour"
