"""The study of sampling: its estimates have the errors that the variances foretell."""

import math

import pytest

from brdfcore.study import STUDIES
from brdfcore.study.sampling import COSINE, OWN, SOBOL, _sentence

COLUMNS = ("model", "theta", "albedo", "variance", "lost", "samples", "time", "slower", "better")


@pytest.fixture(scope="module")
def study():
    return STUDIES["sampling"](models=("lambert", "ward"), angles=(60.0,), counts=(64, 1024), repetitions=24, repeats=1)


def test_errors_fall_as_the_variance_says(study) -> None:
    """24 repetitions: the root mean square is within a factor 1.6 of its expectation at 99.99 %."""
    row = dict(zip(COLUMNS, study.rows[1], strict=True))
    curves = {curve.label: curve for curve in study.charts[0].panels[0].curves}
    assert row["model"] == study.charts[0].panels[0].title == "ward"
    for count, error in zip((64, 1024), curves[OWN].y, strict=True):
        expected = math.sqrt(row["variance"] / count)
        assert expected / 1.6 < error < expected * 1.6
    assert curves[SOBOL].y[1] < curves[OWN].y[1] / 3
    assert curves[OWN].y[1] * 3 < curves[COSINE].y[1] < 0.3, "worse by far, and without bias"
    assert row["samples"] == math.ceil(row["variance"] / 1e-4)
    assert all(seconds > 0 for curve in curves.values() for seconds in curve.x)


def test_a_model_of_even_weights_is_said_and_not_plotted(study) -> None:
    row = dict(zip(COLUMNS, study.rows[0], strict=True))
    assert row["albedo"] == pytest.approx(0.2, rel=1e-12)
    assert row["samples"] == 1
    assert row["slower"] is None
    assert row["better"] is None
    assert [panel.title for panel in study.charts[0].panels] == ["ward"]
    assert any(note.startswith("lambert has even weights") for note in study.notes)


def test_the_sentence_is_computed() -> None:
    rows = [
        ("a", 60.0, 0.1, 1.0, 0.0, 700, 1.0, 4.0, 10.0),
        ("b", 85.0, 0.1, 1.0, 0.0, 900, 1.0, 16.0, 30.0),
        ("c", 60.0, 0.1, 1.0, 0.0, 1, 1.0, None, None),
    ]
    text = _sentence(rows, 512)
    assert "1/10 of the time" in text
    assert "(median of 2)" in text
    assert "cut the error of 512 samples to 1/20" in text
    assert "b at 85 degrees is the dearest, with 900 samples" in text
