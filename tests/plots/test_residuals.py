"""The plot of residuals shows what it says."""

import math
import pathlib
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
import torch
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import brdfcore as bc
from brdfcore.demo import DATA, MODEL
from brdfcore.errors import UnknownNameError


@pytest.fixture(scope="module")
def fit() -> bc.Fit:
    return bc.fit(bc.read(DATA), MODEL)


def points(figure: Figure, panel: int) -> tuple[np.ndarray, np.ndarray]:
    """What the panel's first line draws."""
    x, y = figure.axes[panel].get_lines()[0].get_data()
    return np.asarray(x), np.asarray(y)


def scattered(count: int, values: torch.Tensor | None = None) -> bc.Samples:
    """Samples at as many directions, no two of one incidence."""
    u = torch.rand(4, count, generator=torch.Generator().manual_seed(3), dtype=torch.float64)
    values = 0.1 + 0.05 * u[3] if values is None else values
    return bc.Samples.from_angles(80 * u[0], 0.0, 80 * u[1], 360 * u[2], values, "degrees")


def test_one_panel_an_incidence_and_one_of_theta_h(fit: bc.Fit) -> None:
    figure = bc.plots.residuals(fit)
    assert [axes.get_title() for axes in figure.axes] == [*(f"incidence {t}°" for t in range(25, 76, 10)), ""]
    assert [axes.get_xlabel() for axes in figure.axes] == [""] * 3 + [r"$\theta_o$ [°]"] * 3 + [r"$\theta_h$ [°]"]
    entries = [text.get_text() for text in figure.legends[0].get_texts()]
    assert entries == [*(f"incidence {t}°" for t in range(25, 76, 10)), "median", "2 sigma"]


def test_points_are_model_minus_measurement_over_sigma(fit: bc.Fit) -> None:
    figure, samples = bc.plots.residuals(fit), fit.samples
    left = (fit.material.f(samples.wi, samples.wo).detach() - samples.values) / samples.sigma
    assert figure.get_supylabel() == "(model - measurement) / sigma [1]"
    chosen = (samples.wi[:, 2] - math.cos(math.radians(45))).abs() < 1e-9
    x, y = points(figure, 2)
    np.testing.assert_allclose(y, left[chosen, 0].numpy())
    np.testing.assert_allclose(np.abs(x), np.degrees(np.arccos(samples.wo[chosen, 2].numpy())), atol=1e-6)
    towards_mirror = (samples.wo[chosen, 0] * samples.wi[chosen, 0] < 0).numpy()
    np.testing.assert_array_equal(x[np.abs(x) > 1] > 0, towards_mirror[np.abs(x) > 1])
    drawn = np.concatenate([line.get_ydata() for line in figure.axes[-1].get_lines() if line.get_marker() != "None"])
    np.testing.assert_allclose(np.sort(drawn), np.sort(left[:, 0].numpy()))


def test_without_sigma_residuals_are_relative() -> None:
    samples = bc.Samples.from_angles([30.0] * 3, 0.0, [0.0, 30.0, 60.0], 180.0, [0.1, 0.2, 0.0], "degrees")
    figure = bc.plots.residuals_of(bc.material("lambert(kd=0.3)"), samples)
    f, d = 0.3 / math.pi, 0.001  # the median of 0.1 and 0.2 is torch's lower one
    expected = [(f - y) / (y + d) for y in (0.1, 0.2, 0.0)]
    drawn = sorted(y for line in figure.axes[0].get_lines() for y in line.get_ydata() if line.get_marker() == "o")
    assert drawn == pytest.approx(sorted(expected)[: len(drawn)])
    assert figure.get_supylabel() == "(model - measurement) /\n(measurement + 1 % of its median) [1]"


def test_many_incidences_share_six_bands_that_show_every_sample() -> None:
    figure = bc.plots.residuals_of(bc.material("lambert(kd=0.4)"), scattered(300))
    assert len(figure.axes) == 7
    assert figure.axes[0].get_title().startswith("incidence 0° to ")
    counts = [len(points(figure, panel)[0]) for panel in range(6)]
    assert sum(counts) == 300
    assert min(counts) > 40


def test_a_median_shows_what_noise_hides(fit: bc.Fit) -> None:
    """Blinn's lobe on Ward's data: residuals at the peak, and none elsewhere."""
    wrong = bc.plots.residuals(bc.fit(fit.samples, "lambert + blinn_phong")).axes[-1]
    right = bc.plots.residuals(fit).axes[-1]
    ends = [
        np.abs(next(line for line in axes.get_lines() if line.get_color() == "black").get_ydata()).max()
        for axes in (wrong, right)
    ]
    assert ends[0] > 10
    assert ends[1] < 1


def test_what_is_far_beyond_is_a_triangle_on_the_edge() -> None:
    values = torch.full((300,), 0.1, dtype=torch.float64)
    values[::2] = 0.11
    values[7] = 1e-9
    samples = scattered(300, values)
    figure = bc.plots.residuals_of(bc.material("lambert(kd=0.33)"), samples)
    below = figure.axes[-1]
    assert "beyond the axis" in [text.get_text() for text in figure.legends[0].get_texts()]
    (edge,) = [line for line in below.get_lines() if line.get_marker() == "^" and len(line.get_ydata()) == 1]
    low, high = below.get_ylim()
    assert 0.9 * high < float(edge.get_ydata()[0]) < high < 1
    assert low == -high


def test_of_many_samples_a_part_is_drawn() -> None:
    figure = bc.plots.residuals_of(bc.material("lambert(kd=0.4)"), scattered(30_000))
    assert "20,000 of 30,000 samples drawn" in figure.get_suptitle()
    assert sum(len(points(figure, panel)[0]) for panel in range(6)) == 20_000
    assert bc.plots.to_bytes(figure, "png").startswith(b"\x89PNG")
    assert len(bc.plots.to_bytes(figure, "svg")) < 1_000_000


def test_the_brightest_channel_is_drawn_unless_one_is_named(fit: bc.Fit) -> None:
    samples = fit.samples
    colours = bc.Samples(samples.wi, samples.wo, samples.values * torch.tensor([1.0, 3.0, 2.0]))
    coloured = bc.fit(colours, "lambert")
    for channel, name in ((None, "g"), ("b", "b"), (0, "r")):
        assert f"channel {name}" in bc.plots.residuals(coloured, channel=channel).get_suptitle()
    with pytest.raises(UnknownNameError, match=r"^Expected a channel") as caught:
        bc.plots.residuals(coloured, channel="x")
    assert caught.value.field == "channel"


@pytest.mark.parametrize("count", [1, 3])
def test_few_samples_are_drawn_too(tmp_path: pathlib.Path, count: int) -> None:
    fit = bc.fit(scattered(count), "lambert")
    svg = bc.plots.save(bc.plots.residuals(fit), tmp_path / "residuals.svg")
    assert ElementTree.parse(svg).getroot().tag.endswith("svg")
    assert svg.read_bytes() == bc.plots.to_bytes(bc.plots.residuals(fit), "svg")


def test_texts_stay_inside_and_apart(fit: bc.Fit) -> None:
    figure = bc.plots.residuals(bc.fit(fit.samples, "lambert + ward_bounded + kurt + ashikhmin_shirley + ggx"))
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    boxes = [text.get_window_extent(renderer) for text in (*figure.texts, *(axes.title for axes in figure.axes))]
    boxes = [box for box in [*boxes, figure.legends[0].get_window_extent(renderer)] if box.width > 0]
    width, height = canvas.get_width_height()
    for i, box in enumerate(boxes):
        assert box.x0 >= 0
        assert box.y0 >= 0
        assert box.x1 <= width
        assert box.y1 <= height
        assert not any(box.overlaps(other) for other in boxes[:i])
