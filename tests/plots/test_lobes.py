"""The lobe plot shows what it says."""

import math
import pathlib
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
import torch
from matplotlib.backends.backend_agg import FigureCanvasAgg

import brdfcore as bc
from brdfcore.demo import DATA
from brdfcore.errors import InvalidValueError, UnknownNameError
from brdfcore.geometry import from_angles
from brdfcore.plots.lobes import SCALES

MATERIAL = "lambert(kd=0.12) + ward_bounded(isotropic, rs=0.05, a=0.05)"


@pytest.fixture(scope="module")
def linoleum() -> bc.Samples:
    return bc.read(DATA)


def test_one_panel_an_incidence_of_the_data(linoleum: bc.Samples) -> None:
    figure = bc.plots.lobes(bc.material(MATERIAL), linoleum)
    assert [axes.get_title() for axes in figure.axes] == [f"incidence {t}°" for t in range(25, 76, 10)]


def test_curve_and_points_are_the_model_and_the_data(linoleum: bc.Samples) -> None:
    material = bc.material(MATERIAL)
    axes = bc.plots.lobes(material, linoleum, theta_i_deg=[45]).axes[0]
    curve, points = axes.get_lines()[:2]
    theta, radius = (np.asarray(a) for a in curve.get_data())
    wi = from_angles(torch.tensor(math.pi / 4, dtype=torch.float64), torch.tensor(0.0, dtype=torch.float64))
    wo = from_angles(torch.from_numpy(theta), torch.tensor(math.pi, dtype=torch.float64))
    expected = material.f(wi.expand_as(wo), wo)[:, 0].detach().numpy()
    np.testing.assert_allclose(radius, expected, rtol=1e-9)
    assert math.pi / 4 in theta, "the mirror direction is on the curve"
    at, values = (np.asarray(a) for a in points.get_data())
    chosen = (linoleum.wi[:, 2] - math.cos(math.pi / 4)).abs() < 1e-9
    assert len(at) == int(chosen.sum()) == 37
    np.testing.assert_allclose(np.sort(values), np.sort(linoleum.values[chosen, 0].clamp(min=0).numpy()))
    assert abs(float(at[values.argmax()]) - math.pi / 4) < math.radians(2.1), "the peak lies on the mirror side"


@pytest.mark.parametrize(("scale", "radius"), [("cube_root", 2.0), ("linear", 8.0), ("log", 4.0)])
def test_scales(scale: str, radius: float) -> None:
    """A lobe of constant f = 8: radius 8, its cube root 2, or four decades."""
    samples = bc.Samples.from_angles([20.0], [0.0], [20.0], [180.0], [8.0], "degrees")
    axes = bc.plots.lobes(bc.material("lambert(kd=0)"), samples, scale=scale).axes[0]
    assert float(axes.get_lines()[1].get_ydata()[0]) == pytest.approx(radius)


def test_a_lobe_that_diverges_at_grazing_does_not_set_the_scale() -> None:
    axes = bc.plots.lobes(bc.material("kurt(isotropic, ks=0.5, f0=0.5, m=0.3, alpha=1)"), theta_i_deg=[60]).axes[0]
    assert axes.get_rmax() < 100


def test_a_turned_sample_shows_one_azimuth() -> None:
    """Points of other azimuths would lie beside a curve that is not theirs."""
    angles = [0.0, 0.0, 60.0, 60.0, 60.0]
    values = [1.0, 2.0, 30.0, 40.0, 50.0]
    samples = bc.Samples.from_angles(
        [40.0] * 5, angles, [10, 40, 10, 40, 50], [a + 180 for a in angles], values, "degrees"
    )
    figure = bc.plots.lobes(bc.material("ward(ax=0.1, ay=0.5)"), samples)
    assert sorted(figure.axes[0].get_lines()[1].get_ydata()) == [1.0, 2.0]
    assert any("azimuth 0°" in text.get_text() for text in figure.texts)


@pytest.mark.parametrize("scale", SCALES)
def test_the_caption_names_the_unit_of_the_rings(scale: str) -> None:
    (_, caption) = bc.plots.lobes(bc.material(MATERIAL), scale=scale).texts
    assert "rings: f [1/sr]" in caption.get_text()


def test_channel_is_named(linoleum: bc.Samples) -> None:
    colours = bc.Samples(linoleum.wi, linoleum.wo, linoleum.values.expand(-1, 3) * torch.tensor([1.0, 3.0, 2.0]))
    material = bc.material("lambert(kd=[0.1, 0.3, 0.2])")
    for channel, name in ((None, "g"), ("b", "b"), (0, "r")):
        figure = bc.plots.lobes(material, colours, channel=channel)
        assert any(f"channel {name}" in text.get_text() for text in figure.texts)


@pytest.mark.parametrize(
    ("scale", "count"), [*((SCALES[0], count) for count in range(1, 7)), *((s, 4) for s in SCALES[1:])]
)
def test_files_open_and_are_reproducible(tmp_path: pathlib.Path, linoleum: bc.Samples, scale: str, count: int) -> None:
    figure = bc.plots.lobes(bc.material(MATERIAL), linoleum, scale=scale, theta_i_deg=range(25, 25 + 10 * count, 10))
    svg = bc.plots.save(figure, tmp_path / "lobes.svg")
    assert ElementTree.parse(svg).getroot().tag.endswith("svg")
    assert bc.plots.to_bytes(figure, "svg") == svg.read_bytes()
    assert bc.plots.to_bytes(figure, "png").startswith(b"\x89PNG")


def turned(linoleum: bc.Samples) -> bc.Samples:
    """The samples in three channels, one of a long name, at an azimuth that was observed."""
    values = linoleum.values.expand(-1, 3) * torch.tensor([1.0, 3.0, 2.0])
    names = ("650 nm", "a broad band about 550 nm", "450 nm")
    return bc.Samples(linoleum.wi, linoleum.wo, values, channels=names, azimuth_observed=True)


@pytest.mark.parametrize(
    ("theta_i_deg", "scale"), [(None, "linear"), ([45], "cube_root"), ([45], "log"), ([45, 55], "linear")]
)
def test_texts_do_not_overlap_and_stay_inside(
    linoleum: bc.Samples, theta_i_deg: list[float] | None, scale: str
) -> None:
    """Title, caption, and the titles and ring labels of panels are apart from each other and within the figure."""
    samples = linoleum if theta_i_deg is None else turned(linoleum)
    material = bc.material(" + ".join(["lambert"] + ["ward_bounded"] * 4))
    figure = bc.plots.lobes(material, samples, theta_i_deg=theta_i_deg, scale=scale)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    texts = [*figure.texts, *(axes.title for axes in figure.axes)]
    texts += [label for axes in figure.axes for label in axes.get_yticklabels() if label.get_text()]
    boxes = [text.get_window_extent(renderer) for text in texts]
    width, height = figure.canvas.get_width_height()
    for i, box in enumerate(boxes):
        assert box.x0 >= 0
        assert box.y0 >= 0
        assert box.x1 <= width
        assert box.y1 <= height
        assert not any(box.overlaps(other) for other in boxes[:i])


REFUSED = {
    "one angle": ({"theta_i_deg": 45}, InvalidValueError, "theta_i_deg"),
    "angle": ({"theta_i_deg": [95]}, InvalidValueError, "theta_i_deg"),
    "no angle": ({"theta_i_deg": []}, InvalidValueError, "theta_i_deg"),
    "scale": ({"scale": "cuberoot"}, UnknownNameError, "scale"),
    "channel": ({"channel": "x"}, UnknownNameError, "channel"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refusals(linoleum: bc.Samples, case: str) -> None:
    keywords, kind, field = REFUSED[case]
    with pytest.raises(kind, match=r"^Expected ") as caught:
        bc.plots.lobes(bc.material(MATERIAL), linoleum, **keywords)
    assert caught.value.field == field


def test_another_suffix_is_refused(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InvalidValueError, match=r"to end in \.svg or \.png, got '\.pdf'"):
        bc.plots.save(bc.plots.lobes(bc.material(MATERIAL)), tmp_path / "lobes.pdf")
