"""The plot of directions shows what was measured."""

import numpy as np
import pytest
import torch
from matplotlib.backends.backend_agg import FigureCanvasAgg

import brdfcore as bc
from brdfcore.demo import DATA


def offsets(axes: object) -> np.ndarray:
    return np.asarray(axes.collections[0].get_offsets())  # type: ignore[attr-defined]


def test_points_are_the_directions() -> None:
    samples = bc.read(DATA)
    figure = bc.plots.directions(samples)
    light, viewer, plane = figure.axes[:3]
    assert sorted(offsets(light)[:, 0]) == pytest.approx(np.sin(np.radians(range(25, 76, 10))), abs=1e-4)
    order = samples.values.mean(-1).argsort()
    np.testing.assert_allclose(offsets(viewer), samples.wo[order, :2].numpy())
    brightest = offsets(plane)[-1]
    assert brightest[0] == pytest.approx(0, abs=1e-6), "the largest value is drawn last, in the mirror direction"
    assert brightest[1] == pytest.approx(75)
    assert "222 samples; the sample's azimuth was not observed" in figure.get_suptitle()


def test_a_large_set_is_thinned_and_says_so() -> None:
    w = torch.nn.functional.normalize(torch.rand(50_001, 3, generator=torch.Generator().manual_seed(1)), dim=-1)
    figure = bc.plots.directions(bc.Samples(w, w.flip(0), torch.ones(50_001)), title="made")
    assert len(offsets(figure.axes[1])) == 16_667
    assert figure.get_suptitle().startswith("made: 50,001 samples, of which one in 3 is drawn")


@pytest.mark.parametrize("value", [0.0, -1.0, 2.0])
def test_values_without_a_range_are_drawn(value: float) -> None:
    samples = bc.Samples.from_angles([0.0, 20.0], 0.0, [0.0, 20.0], 180.0, [value, value], "degrees")
    figure = bc.plots.directions(samples)
    FigureCanvasAgg(figure).draw()
    assert len(bc.plots.to_bytes(figure, "svg")) > 1000
