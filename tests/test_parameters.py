"""A parameter's box, its stored form, and the sentences with which it refuses values."""

import math
import re

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from brdfcore.errors import ParameterError
from brdfcore.parameters import Parameter

LINEAR = Parameter("kd", 0.2, 0.0, 1.0, "diffuse reflectance [1]", per_channel="yes")
LOG = Parameter("a", 0.1, 1e-4, 10.0, "width [1]", search=(0.005, 1.5), scale="log")
OPEN = Parameter("x", 0.5, 0.0, 1.0, "open at both ends [1]", open_low=True, open_high=True)
OPEN_LOG = Parameter("y", 0.5, 0.25, 3.0, "open at both ends [1]", scale="log", open_low=True, open_high=True)
WIDE = Parameter("n", 100.0, 1.0, 1e6, "exponent [1]", scale="log")
ALL = [LINEAR, LOG, OPEN, OPEN_LOG, WIDE]
quickly = settings(max_examples=200, deadline=None, derandomize=True, database=None)
every = pytest.mark.parametrize("parameter", ALL, ids=lambda p: p.name)
every_dtype = pytest.mark.parametrize("dtype", [torch.float32, torch.float64])


def number(x: float) -> torch.Tensor:
    return torch.tensor(x, dtype=torch.float64)


def test_search_range_defaults_to_the_box():
    assert LINEAR.search_range == (0.0, 1.0)
    assert LOG.search_range == (0.005, 1.5)


@pytest.mark.parametrize(
    ("parameter", "box"), [(LINEAR, "[0, 1]"), (LOG, "[0.0001, 10]"), (OPEN, "(0, 1)"), (WIDE, "[1, 1e+06]")]
)
def test_boxes_in_interval_notation(parameter, box):
    assert parameter.box == box


@pytest.mark.parametrize(
    ("parameter", "value", "inside"),
    [
        (LINEAR, 0.0, True),
        (LINEAR, 1.0, True),
        (LINEAR, -1e-300, False),
        (LINEAR, 1 + 3e-16, False),
        (LINEAR, math.nan, False),
        (LINEAR, math.inf, False),
        (OPEN, 0.0, False),
        (OPEN, 1.0, False),
        (OPEN, 5e-324, True),
        (OPEN, 1 - 1e-16, True),
        (OPEN, math.nan, False),
        (LOG, 1e-4, True),
        (LOG, 10.0, True),
        (LOG, 9.999e-5, False),
        (OPEN_LOG, 0.25, False),
        (OPEN_LOG, 3.0, False),
    ],
)
def test_contains(parameter, value, inside):
    assert bool(parameter.contains(number(value))) is inside


def test_contains_answers_for_each_channel():
    assert LINEAR.contains(torch.tensor([0.5, -1.0, math.nan, 1.0])).tolist() == [True, False, False, True]


def test_check_passes_what_is_in_the_box():
    LINEAR.check("lambert.kd", number(0.5))
    LINEAR.check("lambert.kd", torch.tensor([0.0, 1.0]))
    LOG.check("ward.a", number(1e-4))


@pytest.mark.parametrize(
    ("parameter", "value", "sentence"),
    [
        (
            LINEAR,
            number(1.5),
            "Expected lambert.kd to be in [0, 1], got 1.5. "
            "It is the diffuse reflectance [1]; choose a value in that range.",
        ),
        (
            LINEAR,
            torch.tensor([0.1, -0.25, 7.0]),
            "Expected lambert.kd to be in [0, 1], got -0.25. "
            "It is the diffuse reflectance [1]; choose a value in that range.",
        ),
        (
            LINEAR,
            number(math.nan),
            "Expected lambert.kd to be in [0, 1], got nan. "
            "It is the diffuse reflectance [1]; choose a value in that range.",
        ),
        (
            LINEAR,
            torch.zeros(1, 1),
            "Expected lambert.kd to be one number or one a channel, got [[0.0]]. Give kd as such.",
        ),
        (LOG, torch.tensor([0.5, 0.25]), "Expected lambert.kd to be one number, got [0.5, 0.25]. Give a as such."),
        (
            OPEN,
            number(0.0),
            "Expected lambert.kd to be in (0, 1), got 0. "
            "It is the open at both ends [1]; choose a value in that range.",
        ),
    ],
    ids=["number", "list", "nan", "table", "shape", "open"],
)
def test_check_refuses_in_one_sentence(parameter, value, sentence):
    with pytest.raises(ParameterError, match=f"^{re.escape(sentence)}$") as caught:
        parameter.check("lambert.kd", value)
    assert caught.value.field == "lambert.kd"


@every_dtype
@every
def test_the_ends_lie_in_the_box_and_are_what_is_stored(parameter, dtype):
    low, high = parameter.ends(dtype)
    eps = torch.finfo(dtype).eps
    for end, nominal in ((low, parameter.low), (high, parameter.high)):
        assert bool(parameter.contains(torch.tensor(end, dtype=dtype)))
        assert bool(parameter.contains(number(end)))
        assert end == pytest.approx(nominal, rel=8 * eps, abs=torch.finfo(dtype).tiny)
    for raw in (-1e30, 1e30):
        assert parameter.from_raw(torch.tensor(raw, dtype=dtype)).item() == (low if raw < 0 else high)


@every_dtype
@every
def test_values_on_the_ends_pass_gradients(parameter, dtype):
    """A value given on an end of its closed box must be able to leave it again."""
    for end, is_open in ((parameter.low, parameter.open_low), (parameter.high, parameter.open_high)):
        if is_open:
            continue
        raw = parameter.to_raw(torch.tensor(end, dtype=dtype)).requires_grad_()
        (gradient,) = torch.autograd.grad(parameter.from_raw(raw), raw)
        assert gradient.item() != 0, end


@every
def test_values_beyond_the_ends_pass_none(parameter):
    for raw in (parameter.to_raw(number(parameter.low or 1.0)) - 5, parameter.to_raw(number(parameter.high)) + 5):
        raw.requires_grad_()
        value = parameter.from_raw(raw)
        assert bool(parameter.contains(value))
        (gradient,) = torch.autograd.grad(value, raw)
        assert gradient.item() == 0


@every_dtype
@every
def test_from_raw_never_leaves_the_box(parameter, dtype):
    span = torch.linspace(-20, 20, 20001, dtype=dtype)
    assert bool(parameter.contains(parameter.from_raw(span)).all())
    assert bool(parameter.contains(parameter.from_raw(span.nextafter(torch.zeros((), dtype=dtype)))).all())


@quickly
@given(st.floats(1e-4, 10))
def test_log_values_round_trip(x):
    once = LOG.from_raw(LOG.to_raw(number(x)))
    assert once.item() == pytest.approx(x, rel=2e-15)
    assert LOG.from_raw(LOG.to_raw(once)).item() == once.item()


def test_stored_values_settle_at_once():
    """value -> stored -> value is exact from the second time on, for JSON to be exact; alone and in arrays."""
    rng = np.random.default_rng(91)
    for parameter in (LOG, WIDE):
        values = torch.tensor(np.exp(rng.uniform(np.log(parameter.low), np.log(parameter.high), 20_001)))
        once = parameter.from_raw(parameter.to_raw(values))
        twice = parameter.from_raw(parameter.to_raw(once))
        assert torch.equal(twice, once)
        alone = torch.stack([parameter.from_raw(parameter.to_raw(v)) for v in once[:2000]])
        assert torch.equal(alone, once[:2000])


@quickly
@given(st.floats(0, 1))
def test_linear_values_are_stored_as_they_are(x):
    assert LINEAR.to_raw(number(x)).item() == x
    assert LINEAR.from_raw(number(x)).item() == x


def test_parameters_are_immutable_and_compare_by_content():
    with pytest.raises(AttributeError):
        LOG.low = 0.0
    assert Parameter("a", 0.1, 0.0, 1.0, "x [1]") == Parameter("a", 0.1, 0.0, 1.0, "x [1]")
    assert Parameter("a", 0.1, 0.0, 1.0, "x [1]") != Parameter("a", 0.1, 0.0, 2.0, "x [1]")
    assert len({LOG, LOG, WIDE}) == 2
