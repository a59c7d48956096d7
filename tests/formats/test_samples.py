"""Samples: conversion, validation, what is derived from them."""

import json
import math
import pickle

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from brdfcore.errors import SamplesError, UnknownNameError
from brdfcore.formats import QUANTITIES, Masked, Samples

UP = [[0.0, 0.0, 1.0]]
TILTED = [[0.6, 0.0, 0.8]]


def plain(count: int = 4, **keywords: object) -> Samples:
    """Some valid samples, tilted in the x-z plane."""
    theta = np.linspace(10, 70, count)
    return Samples.from_angles(theta, 0, theta, 180, np.linspace(1, 2, count), "degrees", **keywords)


def test_tensors_are_float64_copies_on_the_cpu() -> None:
    values = torch.ones(1, 3, dtype=torch.float32, requires_grad=True)
    samples = Samples(TILTED, UP, values)
    for tensor in (samples.wi, samples.wo, samples.values):
        assert tensor.dtype == torch.float64
        assert tensor.device.type == "cpu"
        assert not tensor.requires_grad
    array = np.ones((1, 3))
    copied = Samples(TILTED, UP, array)
    array[:] = 7.0
    assert copied.values.tolist() == [[1.0, 1.0, 1.0]]


def test_samples_are_immutable() -> None:
    samples = plain()
    with pytest.raises(AttributeError, match="cannot assign"):
        samples.values = torch.zeros(4, 1)


@pytest.mark.parametrize(
    ("columns", "names"), [(1, ("value",)), (3, ("r", "g", "b")), (2, ("c0", "c1")), (4, ("c0", "c1", "c2", "c3"))]
)
def test_default_channels(columns: int, names: tuple[str, ...]) -> None:
    assert Samples(UP, UP, np.ones((1, columns))).channels == names


@given(st.floats(-1e6, 1e6).filter(lambda x: x == 0 or abs(x) > 1e-290), st.floats(0, 89), st.floats(1e-6, 1e6))
def test_quantities_are_converted_to_the_brdf(f: float, theta: float, sigma: float) -> None:
    cos = math.cos(math.radians(theta))
    factor = {"brdf": 1.0, "brdf_cos": cos, "reflectance_factor": math.pi}
    for quantity in QUANTITIES:
        k = factor[quantity]
        samples = Samples.from_angles(theta, 0, 10, 0, [f * k], "degrees", sigma=[sigma * k], quantity=quantity)
        assert samples.quantity == quantity
        assert samples.values.item() == pytest.approx(f, rel=1e-14, abs=0)
        assert samples.sigma is not None
        assert samples.sigma.item() == pytest.approx(sigma, rel=1e-14)


@given(st.floats(-89.9, 89.9), st.floats(-720, 720), st.floats(0, 89.9), st.floats(-720, 720))
def test_from_angles_agrees_with_trigonometry(ti: float, pi: float, to: float, po: float) -> None:
    samples = Samples.from_angles([ti], [pi], [to], [po], [1.0], "degrees")
    for w, theta, phi in ((samples.wi, ti, pi), (samples.wo, to, po)):
        if theta < 0:
            theta, phi = -theta, phi + 180
        t, p = math.radians(theta), math.radians(phi)
        expected = [math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)]
        assert w[0].tolist() == pytest.approx(expected, abs=1e-14)  # an azimuth of 720 deg is rounded by 1e-15 rad
    radians = Samples.from_angles(*(np.deg2rad([a]) for a in (ti, pi, to, po)), [1.0], "radians")
    assert torch.allclose(radians.wi, samples.wi, rtol=0, atol=1e-14)


def test_mirror_direction_is_180_degrees_away() -> None:
    samples = Samples.from_angles(40, 25, 40, 205, [1.0], "degrees")
    half = samples.wi + samples.wo
    assert half[0, :2].tolist() == pytest.approx([0, 0], abs=1e-15)


def test_nearly_unit_directions_are_normalised_and_exact_ones_kept() -> None:
    printed = Samples([[0.57735, 0.57735, 0.57735]], UP, [1.0])
    assert printed.wi.norm().item() == pytest.approx(1, abs=1e-15)
    again = Samples(printed.wi, printed.wo, printed.values)
    assert torch.equal(again.wi, printed.wi)


def angles_at(theta_i: object = 10.0, phi_i: object = 0.0, theta_o: object = 10.0, unit: object = "degrees") -> Samples:
    return Samples.from_angles(theta_i, phi_i, theta_o, 0.0, [1.0, 2.0], unit)


@pytest.mark.parametrize(
    ("make", "field", "words"),
    [
        (lambda: Samples([[1.0, 0.0]], UP, [1.0]), "wi", "shape (N, 3), got (1, 2). Pass one unit vector"),
        (lambda: Samples(np.zeros((0, 3)), np.zeros((0, 3)), []), "wi", "at least one sample, got none"),
        (lambda: Samples(UP * 2, UP, [1.0, 1.0]), "wo", "2 directions as wi does, got 1"),
        (lambda: Samples(UP, [[0.0, math.nan, 1.0]], [1.0]), "wo", "finite, got (0, nan, 1) at row 0"),
        (lambda: Samples([*UP, [0.0, 0.0, 1.1]], UP * 2, [1, 1]), "wi", "unit vectors (length 1 within 0.0001), got"),
        (lambda: Samples([[0.0, 0.0, 1e200]], UP, [1.0]), "wi", "unit vectors"),
        (lambda: Samples([[0.0, 0.0, 0.0]], UP, [1.0]), "wi", "unit vectors"),
        (
            lambda: Samples(UP, [[0.6, 0.0, -0.8]], [1.0]),
            "wo",
            "above the horizon (z > 0), got (0.6, 0, -0.8) at row 0",
        ),
        (lambda: Samples([[1.0, 0.0, 0.0]], UP, [1.0]), "wi", "above the horizon"),
        (
            lambda: Samples(UP, UP, [1.0, 2.0]),
            "values",
            "shape (1, C) or (1,) as there are 1 directions wi, got (2, 1)",
        ),
        (lambda: Samples(UP, UP, np.ones((1, 0))), "values", "got (1, 0)"),
        (lambda: Samples(UP, UP, [math.inf]), "values", "finite, got inf at row 0 (counted from 0). Remove the sample"),
        (lambda: Samples(UP, UP, [[1.0, math.nan, 1.0]]), "values", "got nan at row 0 (counted from 0), channel 'g'."),
        (
            lambda: Samples([[1.0, 0.0, 1e-300]], UP, [1e100], quantity="brdf_cos"),
            "values",
            "finite after conversion from brdf_cos to the BRDF, got 1e+100",
        ),
        (lambda: Samples(UP, UP, ["1.0"]), "values", "an array of real numbers, got an array of <U3"),
        (lambda: Samples(UP, UP, [[1.0], [1.0, 2.0]]), "values", "an array of real numbers, got list ("),
        (lambda: Samples(UP, UP, [True]), "values", "an array of real numbers, got an array of bool"),
        (lambda: Samples(UP, UP, torch.ones(1, dtype=torch.bool)), "values", "got torch.bool"),
        (lambda: Samples(UP, UP, [1.0], ("a", "b")), "channels", "1 names as values has 1 columns, got 2"),
        (lambda: Samples(UP, UP, [[1.0, 2.0]], ("a", "a")), "channels", "distinct, non-empty names, got ('a', 'a')"),
        (lambda: Samples(UP, UP, [1.0], ("",)), "channels", "distinct, non-empty"),
        (lambda: Samples(UP, UP, [1.0], ("\ud800",)), "channels", r"names that can be printed, got ('\ud800',)"),
        (lambda: Samples(UP, UP, [1.0], ("a\n",)), "channels", r"names that can be printed, got ('a\n',)"),
        (lambda: Samples(UP, UP, [1.0], sigma=[[1.0, 1.0]]), "sigma", "shape (1, 1) as values are, got (1, 2)"),
        (lambda: Samples(UP, UP, [1.0], sigma=[0.0]), "sigma", "positive and finite, got 0 at row 0"),
        (lambda: Samples(UP, UP, [1.0], sigma=[math.nan]), "sigma", "positive and finite, got nan"),
        (lambda: Samples(UP, UP, [1.0], weight=[-1.0]), "weight", "finite and not negative, got -1 at row 0"),
        (lambda: Samples(UP, UP, [1.0], weight=[1.0, 1.0]), "weight", "shape (1,), got (2,)"),
        (lambda: Samples(UP, UP, [1.0], weight=[0.0]), "weight", "positive for at least one sample, got only zeros"),
        (lambda: Samples(UP, UP, [1.0], cell=[math.inf]), "cell", "finite and not negative, got inf"),
        (lambda: angles_at(unit=None), "unit", 'declared, got nothing. Pass unit="degrees" or unit="radians".'),
        (
            lambda: angles_at(theta_i=[10.0, 90.0]),
            "theta_i",
            "above the horizon (|theta_i| < 90 degrees), got 90 at row 1",
        ),
        (
            lambda: angles_at(theta_i=0.2, theta_o=-1.6, unit="radians"),
            "theta_o",
            "(|theta_o| < pi/2 radians), got -1.6 at row 0",
        ),
        (lambda: angles_at(theta_i=[1.0, 2.0], phi_i=[1.0, 2.0, 3.0]), "theta_i", "shape (3,) or one number, got (2,)"),
        (lambda: angles_at(phi_i=math.nan), "phi_i", "finite, got nan at row 0"),
        (lambda: plain().subset(torch.tensor([4])), "index", "within 0..3, got 4..4"),
        (lambda: plain().subset(torch.tensor([-5])), "index", "within 0..3, got -5..-5"),
        (lambda: plain().subset(torch.zeros(4, dtype=torch.bool)), "index", "at least one sample, got none"),
        (
            lambda: plain().subset(torch.ones(3, dtype=torch.bool)),
            "index",
            "mask of shape (4,), got torch.bool of shape",
        ),
        (lambda: plain().subset(torch.tensor([0.5])), "index", "got torch.float32"),
    ],
)
def test_bad_samples_are_refused_with_a_sentence(make: object, field: str, words: str) -> None:
    with pytest.raises(SamplesError) as caught:
        make()
    assert str(caught.value).startswith(f"Expected {field} to ")
    assert words in str(caught.value)
    assert str(caught.value).endswith(".")
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("make", "field", "nearest"),
    [
        (lambda: Samples(UP, UP, [1.0], quantity="brfd"), "quantity", "Did you mean 'brdf'?"),
        (lambda: Samples(UP, UP, [1.0], quantity=None), "quantity", "Known: brdf, brdf_cos, reflectance_factor."),
        (lambda: angles_at(unit="degree"), "unit", "Did you mean 'degrees'?"),
    ],
)
def test_unknown_names_are_refused_with_the_known_ones(make: object, field: str, nearest: str) -> None:
    with pytest.raises(UnknownNameError) as caught:
        make()
    assert nearest in str(caught.value)
    assert caught.value.field == field


def test_a_reader_names_its_own_rows() -> None:
    with pytest.raises(SamplesError, match="got nan at line 17"):
        Samples(UP, UP, [math.nan], where=lambda row: f"line {row + 17}")


@pytest.mark.parametrize(
    ("index", "rows"),
    [
        (torch.tensor([2, 0]), [2, 0]),
        (torch.tensor([-1]), [3]),
        (torch.tensor([1, 2], dtype=torch.int32), [1, 2]),
        (torch.tensor([True, False, False, True]), [0, 3]),
    ],
)
def test_subset_keeps_every_field_of_the_picked_rows(index: Tensor, rows: list[int]) -> None:
    masked = (Masked("for a reason", 3),)
    keywords = {"weight": [1, 2, 3, 4], "cell": [5, 6, 7, 8], "sigma": [0.1, 0.2, 0.3, 0.4]}
    whole = plain(**keywords, masked=masked, source="file", format="csv", quantity="brdf_cos")
    part = whole.subset(index)
    assert len(part) == len(rows)
    for name in ("wi", "wo", "values", "sigma", "weight", "cell"):
        assert torch.equal(getattr(part, name), getattr(whole, name)[rows]), name
    assert (part.channels, part.quantity, part.masked, part.source, part.format) == (
        whole.channels,
        "brdf_cos",
        masked,
        "file",
        "csv",
    )


def test_subset_derives_the_azimuth_again_but_keeps_a_declared_one() -> None:
    turned = Samples.from_angles(30, [0.0, 0.0, 40.0], 30, 0, [1.0, 1.0, 1.0], "degrees")
    assert turned.azimuth_observed
    assert not turned.subset(torch.tensor([0, 1])).azimuth_observed
    declared = Samples(turned.wi, turned.wo, turned.values, azimuth_observed=False)
    assert not declared.subset(torch.tensor([0, 2])).azimuth_observed


@pytest.mark.parametrize(
    ("theta", "phi", "observed"),
    [
        ([30, 30], [0, 0], False),
        ([30, 30], [0, 180], False),  # in-plane: the same plane of incidence from both sides
        ([30, 30], [0, -180], False),
        ([30, -30], [10, 10], False),
        ([30, 30], [0, 0.9], False),  # within the reading's accuracy
        ([30, 30], [0, 1.1], True),
        ([30, 30], [89.8, -89.8], False),  # 0.4 deg apart modulo 180 deg
        ([30, 30, 30], [0, 120, 240], True),
        ([30, 30], [0, 90], True),
        ([0.9, 0.9], [0, 90], False),  # near the normal an azimuth says nothing
        ([0.9, 30], [0, 90], False),
    ],
)
def test_azimuth_observed(theta: list[float], phi: list[float], observed: bool) -> None:
    samples = Samples.from_angles(theta, phi, 20, np.linspace(0, 90, len(phi)), np.ones(len(phi)), "degrees")
    assert samples.azimuth_observed is observed
    for declared in (True, False):
        again = Samples(samples.wi, samples.wo, samples.values, azimuth_observed=declared)
        assert again.azimuth_observed is declared


def test_report_is_json_and_counts() -> None:
    samples = Samples.from_angles(
        [-10, 20, 60],
        [0, 5, 90],
        [0, 30, 80],
        [0, 180, -90],
        [[1.0, 0.0], [0.0, -2.0], [3.0, 0.0]],
        "degrees",
        masked=[Masked("value is empty", 2)],
        source="a.csv",
        format="csv",
        weight=[1, 1, 1],
    )
    report = json.loads(json.dumps(samples.report(), allow_nan=False))
    ranges = {name: report.pop(name) for name in ("theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg")}
    assert ranges["theta_i_deg"] == pytest.approx([10, 60])
    assert ranges["phi_i_deg"] == pytest.approx([5, 180])
    assert ranges["theta_o_deg"] == pytest.approx([0, 80])
    assert ranges["phi_o_deg"] == pytest.approx([-90, 180])
    assert report == {
        "source": "a.csv",
        "format": "csv",
        "quantity": "brdf",
        "samples": 3,
        "channels": ["c0", "c1"],
        "azimuth_observed": True,
        "value_range": [-2.0, 3.0],
        "negative_values": 1,
        "zero_values": 3,
        "has_sigma": False,
        "has_weight": True,
        "masked": [{"reason": "value is empty", "count": 2}],
    }


def test_hash_is_of_the_content() -> None:
    base = plain()
    # a regression number: the hash names datasets across versions, so it must not drift
    assert Samples(UP, UP, [0.5]).hash == "sha256:ac60dfb402c740aa96145cacd029ff27a156504d7290bb924d660840704685ac"
    assert plain().hash == base.hash
    assert plain(source="elsewhere", masked=[Masked("x", 1)]).hash == base.hash
    assert Samples(base.wi, base.wo, base.values * 0.0).hash == Samples(base.wi, base.wo, base.values * -0.0).hash
    others = [
        plain(weight=[1, 1, 1, 1]),
        plain(cell=[1, 1, 1, 1]),
        plain(sigma=[1, 1, 1, 1]),
        plain(channels=["550"]),
        Samples(base.wo, base.wi, base.values),
        Samples(base.wi, base.wo, base.values * 2),
        base.subset(torch.tensor([0, 1, 2])),
    ]
    hashes = {other.hash for other in others}
    assert len(hashes) == len(others)
    assert base.hash not in hashes


def test_samples_pickle_and_name_themselves() -> None:
    samples = plain(source="a.csv")
    copied = pickle.loads(pickle.dumps(samples))
    assert copied.hash == samples.hash
    assert repr(copied) == "Samples(4 samples, 1 channels, declared brdf, from 'a.csv')"


@settings(max_examples=50)
@given(st.integers(1, 20), st.integers(1, 5), st.integers(0, 2**32 - 1))
def test_every_valid_set_of_samples_is_accepted_and_reported(count: int, channels: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    w = random.normal(size=(2, count, 3))
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    w[..., 2] = np.abs(w[..., 2]) + 1e-15
    samples = Samples(w[0], w[1], random.normal(size=(count, channels)))
    assert len(samples) == count
    json.dumps(samples.report(), allow_nan=False)
    assert torch.allclose(samples.wi.norm(dim=-1), torch.ones(count, dtype=torch.float64), rtol=0, atol=2e-15)
