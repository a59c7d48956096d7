"""Columns to samples: what is masked, what is refused."""

import math

import numpy as np
import pytest

from brdfcore.errors import FormatError, SamplesError
from brdfcore.formats import Masked
from brdfcore.formats._assemble import from_columns

HORIZON = "a direction is at the horizon, where no BRDF can be measured"
EMPTY = "a value's cell is empty"


def columns(theta_i: list[float], theta_o: list[float]) -> dict[str, np.ndarray]:
    zero = np.zeros(len(theta_i))
    return {"theta_i": np.array(theta_i), "phi_i": zero, "theta_o": np.array(theta_o), "phi_o": zero}


def test_horizon_and_empty_rows_are_masked_each_once_with_all_their_fields() -> None:
    right = math.pi / 2
    values = np.array([[1.0], [2.0], [math.nan], [math.nan], [5.0], [6.0]])
    samples = from_columns(
        columns([0.1, right, 0.3, -right, 0.5, 0.6], [0.1, 0.2, 0.3, 0.4, 1.5708, 0.6]),
        values,
        weight=np.arange(1.0, 7.0),
        cell=np.arange(11.0, 17.0),
        sigma=np.arange(21.0, 27.0)[:, None],
        masked=[Masked("before", 1)],
    )
    assert samples.values[:, 0].tolist() == [1.0, 6.0]
    for field, first in ((samples.weight, 1.0), (samples.cell, 11.0), (samples.sigma, 21.0)):
        assert field is not None
        assert field.ravel().tolist() == [first, first + 5]
    assert samples.masked == (Masked("before", 1), Masked(HORIZON, 3), Masked(EMPTY, 1))


def test_vectors_at_the_horizon_are_masked() -> None:
    up, flat = [0.0, 0.0, 1.0], [1.0, 0.0, -1e-12]
    samples = from_columns({"wi": np.array([up, flat]), "wo": np.array([up, up])}, np.ones((2, 1)))
    assert samples.masked == (Masked(HORIZON, 1),)
    assert len(samples) == 1


def test_a_direction_below_the_horizon_is_refused_by_its_row() -> None:
    with pytest.raises(
        SamplesError, match=r"theta_o to be at most 90 degrees.*, got 91 degrees at line 8\. .*angle_unit"
    ):
        from_columns(
            columns([0.1, 0.2], [0.1, -math.radians(91)]), np.ones((2, 1)), where=lambda row: f"line {row + 7}"
        )
    wi = np.array([[0.6, 0.0, 0.8], [0.6, 0.0, -0.8]])
    with pytest.raises(SamplesError, match=r"wi to be above the horizon \(z > 0\), got z = -0.8 at row 1") as caught:
        from_columns({"wi": wi, "wo": np.abs(wi)}, np.ones((2, 1)))
    assert caught.value.field == "wi"


def test_a_tilt_beyond_270_degrees_is_below_the_horizon_too() -> None:
    with pytest.raises(SamplesError, match="got 300 degrees"):
        from_columns(columns([math.radians(300)], [0.1]), np.ones((1, 1)))


def test_nothing_left_is_an_error_that_says_why() -> None:
    with pytest.raises(FormatError, match=r"one usable sample, got only 1 rows where a value's cell is empty\. Check"):
        from_columns(columns([0.1], [0.1]), np.array([[math.nan]]))


def test_errors_after_masking_still_name_the_file_row() -> None:
    with pytest.raises(SamplesError, match="sigma to be positive and finite, got -1 at row 2"):
        from_columns(
            columns([0.1, math.pi / 2, 0.1], [0.1] * 3), np.ones((3, 1)), sigma=np.array([[1.0], [1.0], [-1.0]])
        )
