"""Keywords of every type that means something are taken, and those that mean nothing are refused in a sentence."""

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import torch
from fit_cases import TRUE, measured_from

import brdfcore as bc
from brdfcore.errors import BrdfError
from brdfcore.fitting import check, fit_batch
from brdfcore.fitting.plan import Plan

SAMPLES = measured_from("lambert(kd=0.2) + ward_bounded(isotropic, rs=0.1, a=0.15)", count=80, noise=0.01)
MODEL = "lambert + ward_bounded(isotropic)"

SAME: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "single precision": ({"fixed": {"ward_bounded.a": np.float32(0.25)}}, {"fixed": {"ward_bounded.a": 0.25}}),
    "an array of no dimension": ({"fixed": {"ward_bounded.a": np.array(0.25)}}, {"fixed": {"ward_bounded.a": 0.25}}),
    "a tensor": ({"fixed": {"ward_bounded.a": torch.tensor(0.25)}}, {"fixed": {"ward_bounded.a": 0.25}}),
    "a fraction": ({"fixed": {"ward_bounded.a": Fraction(1, 4)}}, {"fixed": {"ward_bounded.a": 0.25}}),
    "an array": ({"fixed": {"lambert.kd": np.array([0.25])}}, {"fixed": {"lambert.kd": [0.25]}}),
    "bounds": (
        {"bounds": {"lambert.kd": (np.float32(0), np.float64(0.5))}},
        {"bounds": {"lambert.kd": (0, 0.5)}},
    ),
    "a seed": ({"seed": np.int64(3)}, {"seed": 3}),
    "an angle": ({"max_theta": np.float32(1)}, {"max_theta": 1.0}),
    "a robust scale": (
        {"robust": "cauchy", "robust_scale": np.float32(0.5)},
        {"robust": "cauchy", "robust_scale": 0.5},
    ),
    "starts": ({"starts": iter([{"ward_bounded.a": np.float32(0.5)}])}, {"starts": [{"ward_bounded.a": 0.5}]}),
    "none of them": ({"gray": None, "per_channel": None, "starts": None, "fixed": None, "bounds": None}, {}),
}


def same(mine: Plan, other: Plan) -> bool:
    return str(vars(mine)) == str(vars(other))


@pytest.mark.parametrize("case", SAME)
def test_numbers_of_any_type_are_numbers(case: str) -> None:
    given, plain = SAME[case]
    assert same(check(1, MODEL, **given), check(1, MODEL, **plain))


def test_the_result_holds_plain_numbers() -> None:
    fit = bc.fit(SAMPLES, MODEL, seed=np.int64(3), max_theta=np.float32(1), fixed={"ward_bounded.a": np.float32(0.25)})
    assert type(fit.provenance["seed"]) is int
    assert type(fit.plan.max_theta) is float
    assert fit.to_dict()["parameters"]["ward_bounded.a"] == 0.25
    assert len(bc.next_directions(fit, np.int64(2), np.float32(1)).wi) == 2
    assert len(bc.held_out(SAMPLES, MODEL, folds=np.int64(3)).folds) == 3


def test_a_generator_serves_every_fit() -> None:
    """Of several materials, of several models, and of those that a ladder tries."""
    coloured = measured_from(TRUE, count=80, noise=0.01)
    wide = measured_from(TRUE, count=81, noise=0.01)
    models = ["lambert", MODEL]

    def gray() -> Any:
        return iter(["lambert.kd"])

    for fit in fit_batch([coloured, wide], MODEL, gray=gray()):
        assert fit.gray == ("lambert.kd",)
    for fit in bc.compare(coloured, iter(models), gray=gray(), starts=iter([{"lambert.kd": 0.3}])).fits:
        assert fit.gray == ("lambert.kd",)
        assert len(fit.plan.starts) == 1
    chosen = bc.fit(coloured, models, gray=gray())
    assert chosen.gray == ("lambert.kd",)
    assert {rung.parameters for rung in chosen.ladder} == {1, 5}


REFUSED: dict[str, tuple[Callable[[], object], str, str]] = {
    "fixed 5": (lambda: bc.fit(SAMPLES, MODEL, fixed=5), "fixed", "a mapping of keys to values, got int"),
    "fixed list": (lambda: bc.fit(SAMPLES, MODEL, fixed=["a"]), "fixed", "a mapping of keys to values, got list"),
    "fixed key": (lambda: bc.fit(SAMPLES, MODEL, fixed={1: 0.2}), "fixed", "to be a known name, got 1."),
    "fixed truth": (lambda: bc.fit(SAMPLES, MODEL, fixed={"lambert.kd": np.True_}), "lambert.kd", "a number"),
    "fixed ragged": (lambda: bc.fit(SAMPLES, MODEL, fixed={"lambert.kd": [[0.1]]}), "lambert.kd", "a number"),
    "fixed complex": (lambda: bc.fit(SAMPLES, MODEL, fixed={"lambert.kd": np.complex64(1)}), "lambert.kd", "a number"),
    "gray 5": (lambda: bc.fit(SAMPLES, MODEL, gray=5), "gray", "a list of keys, got 5. Write it like ['lambert.kd']"),
    "gray of numbers": (lambda: bc.fit(SAMPLES, MODEL, gray=[1]), "gray", "a list of keys, got 1 in it."),
    "per_channel of lists": (lambda: bc.fit(SAMPLES, MODEL, per_channel=[["a"]]), "per_channel", "got ['a'] in it."),
    "starts 5": (lambda: bc.fit(SAMPLES, MODEL, starts=5), "starts", "a list of mappings of keys to values, got int."),
    "bounds of text": (lambda: bc.fit(SAMPLES, MODEL, bounds={"lambert.kd": "ab"}), "bounds", "two numbers"),
    "loss None": (lambda: bc.fit(SAMPLES, MODEL, loss=None), "loss", "a known name, got None."),
    "loss list": (lambda: bc.fit(SAMPLES, MODEL, loss=[1]), "loss", "a known name, got [1]."),
    "optimizer list": (lambda: bc.fit(SAMPLES, MODEL, optimizer=["adam"]), "optimizer", "got ['adam']."),
    "robust list": (lambda: bc.fit(SAMPLES, MODEL, robust=["a"]), "robust", "a known name, got ['a']."),
    "robust_scale text": (lambda: bc.fit(SAMPLES, MODEL, robust="cauchy", robust_scale="1"), "robust_scale", "got '1'"),
    "seed 1.5": (lambda: bc.fit(SAMPLES, MODEL, seed=np.float64(1.5)), "seed", "a whole number"),
    "a batch of one": (lambda: fit_batch(SAMPLES, MODEL), "samples", "a list of Samples, got Samples. Pass a list, or"),
    "a batch of 5": (lambda: fit_batch(5, MODEL), "samples", "a list of Samples, got int."),
    "models 5": (lambda: bc.compare(SAMPLES, 5), "models", "a list of texts, got 5."),
    "models of lists": (lambda: bc.compare(SAMPLES, [["lambert"]]), "models", "a list of texts, got [['lambert']]."),
    "no models": (lambda: bc.compare(SAMPLES, iter([])), "models", "a list of texts, got "),
    "auto compared": (
        lambda: bc.compare(SAMPLES, ["lambert", "auto"]),
        "models",
        'got "auto" among them, which chooses',
    ),
    "no angle": (lambda: bc.next_directions(bc.fit(SAMPLES, MODEL), 3, None), "max_theta", "radians, got None."),
    "no fit": (lambda: bc.next_directions(None, 2), "fit", "to be a Fit, got NoneType."),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_means_nothing_is_refused_in_a_sentence(case: str) -> None:
    call, field, part = REFUSED[case]
    with pytest.raises(BrdfError) as caught:
        call()
    assert caught.value.field == field
    assert str(caught.value).startswith("Expected ")
    assert part in str(caught.value)


def test_values_that_auto_may_end_with_may_be_named_and_what_falls_away_is_told() -> None:
    flat = measured_from("lambert(kd=0.2)", count=80, noise=0.01)
    fit = bc.fit(flat, "auto", fixed={"ggx.a": 0.15}, gray=["ward_bounded.rs", "beckmann_2.ks"])
    assert fit.model == "lambert"
    told = "fixed names ggx.a, which the material chosen does not have, so that had no effect on it."
    assert told in fit.choices
    assert "gray names ward_bounded.rs, beckmann_2.ks, which" in fit.report()
    kept = bc.fit(SAMPLES, ["lambert", MODEL], fixed={"ward_bounded.a": 0.15})
    assert not any("had no effect" in sentence for sentence in kept.choices)


def test_a_ladder_of_free_fits_says_so_where_energy_is_conserved() -> None:
    flat = measured_from("lambert(kd=0.2)", count=80, noise=0.01)
    sentence = (
        "The ladder's materials are compared by fits that are free of this; energy is conserved in the chosen one."
    )
    assert bc.fit(flat, ["lambert", MODEL], conserve_energy=True).choices[-1] == sentence
    assert sentence not in bc.fit(flat, ["lambert", MODEL]).choices


@pytest.mark.parametrize("single", [False, True])
def test_samples_at_the_limiting_angle_stay(single: bool) -> None:
    """Each whole degree, as it is written in files and as directions of single precision hold it."""
    theta = torch.arange(1.0, 90.0).double()
    for phi in (0.0, 30.0, 77.0):
        there = bc.Samples.from_angles(theta, phi, theta, phi + 180, torch.ones(89), unit="degrees")
        if single:
            there = bc.Samples(there.wi.float(), there.wo.float(), there.values)
        for degrees in (1, 20, 45, 80, 89):
            fit = bc.fit(there, "lambert", max_theta=math.radians(degrees))
            assert len(fit.samples) == degrees


@pytest.mark.parametrize(
    "keywords",
    [
        {"robust": "cauchy", "robust_scale": 10**400},
        {"max_theta": 10**400},
        {"bounds": {"lambert.kd": (0, 10**400)}},
        {"fixed": {"lambert.kd": -(10**400)}},
        {"starts": [{"lambert.kd": 10**400}]},
    ],
)
def test_a_whole_number_beyond_any_double_is_a_sentence(keywords: dict[str, Any]) -> None:
    with pytest.raises(BrdfError, match=r"^Expected .*inf"):
        bc.fit(measured_from("lambert(kd=0.2)", count=20), "lambert", **keywords)
