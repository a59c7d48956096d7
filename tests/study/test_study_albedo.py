"""The study of albedos: errors against a reference, claims that hold, and what the study concludes."""

import pytest

from brdfcore.energy.albedo import METHODS
from brdfcore.study import STUDIES
from brdfcore.study.albedo import _Point, _reached, _sentence


@pytest.fixture(scope="module")
def study():
    return STUDIES["albedo"](widths=(0.3,), angles=(40.0,), tolerances=(1e-2, 1e-6), limit=0.2, repeats=1)


def test_every_method_is_compared(study) -> None:
    rows = {row[2]: row for row in study.rows}
    assert set(rows) == set(METHODS)
    for method in ("auto", "closed_form", "slope_disc"):
        assert rows[method][5] < 1e-6, method
        assert rows[method][7] is True, method
    assert rows["monte_carlo"][5] < 0.1
    assert {curve.label for curve in study.charts[0].panels[0].curves} == set(METHODS)
    assert "auto: it is within 1e-06 in 1 of 1 cases" in study.sentence


def test_what_a_method_reached() -> None:
    points = [
        _Point(1e-2, 5e-3, 9e-3, True, 1.0),
        _Point(1e-4, 2e-5, 1e-4, True, 1.0),
        _Point(1e-7, 1e-7, 5e-8, True, 1.0),
    ]
    near, far, smallest, after, hold = _reached(points, (0.1, 0.3, 0.2))
    assert (near, far) == (0.2, 0.2), "the soonest that is good enough"
    assert (smallest, after) == (1e-7, 0.2)
    assert hold is False, "the last error is larger than what was claimed of it"
    assert _reached(points[:2], (0.1, 0.3))[:2] == (0.3, None)
    assert _reached(points[:2], (0.1, 0.3))[4] is True


def test_the_sentence_is_computed() -> None:
    rows = [
        (0.1, 0.0, "auto", 0.01, 0.02, 1e-9, 0.1, True),
        (0.1, 60.0, "auto", 0.02, 0.04, 1e-9, 0.1, True),
        (0.1, 0.0, "sobol", 0.05, 0.2, 1e-7, 0.1, True),
        (0.1, 60.0, "sobol", 0.3, 0.8, 1e-7, 0.1, True),
        (0.1, 0.0, "monte_carlo", 0.1, None, 1e-2, 0.1, True),
        (0.1, 60.0, "monte_carlo", None, None, 1e-2, 0.1, True),
    ]
    assert _sentence(rows) == (
        "Leave the method to auto: it is within 1e-06 in 2 of 2 cases, after at most 0.04 s; "
        "sobol in 2 (15x the time), monte_carlo in 0."
    )
    rows[1] = (0.1, 60.0, "auto", 0.02, None, 1e-5, 0.1, True)
    rows[5] = (*rows[5][:7], False)
    text = _sentence(rows)
    assert "in 1 of 2 cases, after at most 0.02 s; sobol in 2 (10x the time)" in text
    assert text.endswith("doubt the claims of monte_carlo (1 of 2).")
