"""Lines of equal luminance stand where the luminance is theirs."""

import numpy as np
import pytest
import torch

import brdfcore as bc
from brdfcore.errors import InvalidValueError
from brdfcore.render import Camera, Directional, Dome, Image, Plan, Plane, Scene, plan


@pytest.fixture(scope="module")
def made() -> Plan:
    view = Camera(position=(0, 0, 3), look_at=(1, 0, 0), width=40, height=20)
    light = Directional(direction=(0, 0, 1), irradiance=1.0)
    return plan(Scene(camera=view, objects=[Plane(material="lambert")], lights=[light, Dome(radiance=1.0)]))


def image(made: Plan, luminance: torch.Tensor, noise: float = 0.0) -> Image:
    pixels = luminance.unsqueeze(-1).expand(*luminance.shape, 3)
    return Image(pixels, torch.full_like(pixels, noise), made, 1, 0.0)


def lines(figure, axes: int = 0) -> dict[float, np.ndarray]:
    """The points (N, 2) of the line of each level."""
    (found,) = (one for one in figure.axes[axes].collections if hasattr(one, "levels"))
    return dict(zip(found.levels, (path.vertices for path in found.get_paths()), strict=True))


def test_lines_stand_at_their_levels_and_say_them(made: Plan) -> None:
    ramp = torch.linspace(0, 3.9, 40, dtype=torch.float64).expand(20, 40)
    figure = bc.plots.contours(image(made, ramp), [1.0, 2.0, 8.0], title="ramp")
    drawn = lines(figure)
    assert list(drawn) == [1.0, 2.0]
    for level, points in drawn.items():
        np.testing.assert_allclose(points[:, 0], 10 * level, atol=1e-9)
    assert {text.get_text() for text in figure.axes[0].texts} == {"1", "2"}
    assert figure.get_suptitle() == "ramp"


def test_images_share_their_levels_and_even_ones_have_none(made: Plan) -> None:
    ramp = torch.linspace(0, 1, 40, dtype=torch.float64).expand(20, 40)
    figure = bc.plots.contours(
        {"ramp": image(made, ramp), "half": image(made, ramp / 2), "even": image(made, 0 * ramp)}
    )
    whole, half = lines(figure), lines(figure, 1)
    assert list(whole) == pytest.approx([0.1 * k for k in range(1, 10)])
    assert list(half) == pytest.approx(list(whole)[:4])
    assert whole[0.2][0, 0] == pytest.approx(half[0.1][0, 0])
    assert not figure.axes[2].collections
    assert [axes.get_title() for axes in figure.axes] == ["ramp", "half", "even"]
    assert bc.plots.to_bytes(figure, "svg").startswith(b"<?xml")


def test_noise_does_not_fray_them(made: Plan, generator: torch.Generator) -> None:
    ramp = torch.linspace(0, 1, 40, dtype=torch.float64).expand(20, 40)
    noisy = ramp + 0.1 * torch.randn(20, 40, generator=generator, dtype=torch.float64)
    smooth = lines(bc.plots.contours(image(made, noisy, 0.1), [0.25, 0.5, 0.75]))[0.5][:, 0]
    frayed = lines(bc.plots.contours(image(made, noisy), [0.25, 0.5, 0.75]))[0.5][:, 0]
    assert np.abs(smooth - 19.5).max() < 4
    assert np.std(smooth) < 0.6 * np.std(frayed)


def test_mistakes_are_one_sentence(made: Plan) -> None:
    with pytest.raises(InvalidValueError, match=r"^Expected images of at least 2 x 2 pixels, got 3 x 1\. Render"):
        bc.plots.contours(image(made, torch.ones(1, 3)))
    with pytest.raises(InvalidValueError, match=r"^Expected images and levels, got none of them\."):
        bc.plots.contours(image(made, torch.ones(3, 3)), [])
