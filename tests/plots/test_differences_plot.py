"""Images and what they differ by: the difference, its scale, and the ratio."""

import math

import numpy as np
import pytest
import torch

import brdfcore as bc
from brdfcore.errors import InvalidValueError
from brdfcore.render import Camera, Dome, Image, Plan, Scene, Sphere, plan, psnr


@pytest.fixture(scope="module")
def made() -> Plan:
    view = Camera(position=(4, 0, 0), look_at=(0, 0, 0), width=6, height=4)
    ball = Sphere(center=(0, 0, 0), radius=1, material="lambert")
    return plan(Scene(camera=view, objects=[ball], lights=[Dome(radiance=1.0)], exposure=2.0))


def image(made: Plan, value: float, more: float = 0.0) -> Image:
    pixels = torch.full((4, 6, 3), value, dtype=torch.float64)
    pixels[0, 0] += more
    return Image(pixels, torch.zeros_like(pixels), made, 1, 0.0)


def curve(x: float) -> float:
    return 1.055 * x ** (1 / 2.4) - 0.055


def test_the_ratio_is_that_of_the_curve(made: Plan) -> None:
    """Of a single pixel of 24 that differs; both exposed by 2, and beyond white nothing is seen."""
    off = curve(2 * 0.3) - curve(2 * 0.2)
    assert psnr(image(made, 0.2, 0.1), image(made, 0.2)) == pytest.approx(-10 * math.log10(off**2 / 24))
    assert psnr(image(made, 5.0), image(made, 3.0)) == 200
    black = image(made, 0.0)
    assert psnr(image(made, 5.0), black) == pytest.approx(0)


def test_differences_are_dark_where_they_are_large(made: Plan) -> None:
    base = image(made, 0.2)
    pairs = {"same": (base, base), "spot": (image(made, 0.2, 0.1), base), "half": (image(made, 0.2, 0.05), base)}
    figure = bc.plots.differences(pairs, "Three", columns=2)
    assert figure.get_suptitle() == f"Three (black: {curve(0.6) - curve(0.4):.2g} of white)"
    assert figure.axes[0].get_title() == "same\nexact"
    same, spot, half = (np.array(figure.axes[k].images[0].get_array()) for k in (2, 3, 6))
    assert same.min() == 1
    assert spot[0, 0] == 0
    assert spot[1:].min() == 1
    assert 0 < half[0, 0] < 1
    assert not figure.axes[5].images


def test_sizes_must_agree(made: Plan) -> None:
    small = Image(torch.zeros(2, 2, 3), torch.zeros(2, 2, 3), made, 1, 0.0)
    with pytest.raises(InvalidValueError, match=r"^Expected images of one size, got \[\(2, 2\), \(4, 6\)\]\. Render"):
        bc.plots.differences({"a": (small, image(made, 1.0))})
    with pytest.raises(InvalidValueError, match=r"^Expected images of one size, got \[\]"):
        bc.plots.differences({})
