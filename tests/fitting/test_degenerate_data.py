"""Data that cannot show what is asked of them: every fit ends with a status and a sentence, and without a NaN."""

import json
import math
import pathlib

import numpy as np
import pytest
import torch
from fit_cases import TRUE, directions, measured_from

import brdfcore as bc
from brdfcore.errors import InvalidValueError, SamplesError
from brdfcore.fitting import search
from brdfcore.fitting.lbfgs import lbfgs
from brdfcore.fitting.result import STATUSES

MODELS = (
    "lambert",
    "lambert + kurt",
    "lambert + ward_bounded(anisotropic) + ward_bounded(isotropic)",
)
WI, WO = directions(30, 0)
RANDOM = torch.rand(30, 1, generator=torch.Generator().manual_seed(2), dtype=torch.float64)
MODEL_VALUES = measured_from("lambert(kd=0.2) + ward_bounded(isotropic, rs=0.1, a=0.15)", noise=0.01).values


def one_incidence() -> bc.Samples:
    theta_o = torch.linspace(-80, 80, 41).tolist()
    clean = bc.Samples.from_angles(45.0, 0.0, theta_o, 180.0, [1.0] * 41, "degrees")
    f = bc.material("lambert(kd=0.2) + kurt(isotropic, ks=0.4, f0=0.1, m=0.15, alpha=0.2)").f(clean.wi, clean.wo)
    return bc.Samples(clean.wi, clean.wo, f.detach() * (1 + 0.02 * torch.sin(torch.arange(41.0))[:, None]))


# the samples, and what a fit of a lobe to them must say
CASES = {
    "fewer samples than values": (bc.Samples(WI[:2], WO[:2], RANDOM[:2]), "2 samples of 1 channel, too few"),
    "one sample": (bc.Samples(WI[:1], WO[:1], RANDOM[:1]), "1 sample of 1 channel, too few"),
    "all zero": (bc.Samples(WI, WO, 0 * RANDOM), "No value is positive"),
    "all negative": (bc.Samples(WI, WO, -RANDOM), "No value is positive"),
    "one direction": (bc.Samples(WI[:1].expand(30, 3), WO[:1].expand(30, 3), RANDOM), "share one pair of directions"),
    "constant": (bc.Samples(WI, WO, 0 * RANDOM + 0.3), "same value, in which no lobe can be seen"),
    "one incidence": (one_incidence(), "All samples have one angle of incidence, 45 degrees"),
    "colossal range": (bc.Samples(WI, WO, 10.0 ** (60 * RANDOM - 30)), "the cosine loss sees little but the peak"),
    "tiny": (bc.Samples(WI, WO, 1e-100 * RANDOM), ""),
    "huge": (bc.Samples(WI, WO, 1e100 * RANDOM), ""),
}


def check(fit: bc.Fit) -> None:
    """The fit has a status, sentences, finite numbers throughout its material, and intervals only where it tells."""
    assert fit.status in STATUSES
    assert fit.message.endswith(".")
    assert all(sentence.endswith(".") for sentence in fit.warnings)
    assert math.isfinite(fit.objective)
    assert all(math.isfinite(error) for error in fit.errors.values())
    assert all(bool(value.isfinite().all()) for value in fit.material.values().values())
    for key, value in fit.parameters.items():
        assert not bool(fit.intervals[key][value.isnan()].isfinite().any()), key
        assert not bool(value.isinf().any())
    assert bool(fit.covariance.isfinite().all())
    assert all(math.isfinite(value) for value in fit.singular_values)
    json.dumps(fit.to_dict(), allow_nan=False)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("case", CASES)
def test_degenerate_data_end_in_a_sentence(case: str, model: str) -> None:
    samples, sentence = CASES[case]
    fit = bc.fit(samples, model)
    check(fit)
    if model != "lambert":
        assert sentence in " ".join(fit.warnings)
        assert all(line in fit.report() for line in fit.warnings)


@pytest.mark.parametrize(
    "loss", ["log", *(pytest.param(loss, marks=pytest.mark.full) for loss in ("cube_root", "relative"))]
)
@pytest.mark.parametrize("case", CASES)
def test_so_it_is_under_every_loss(case: str, loss: str) -> None:
    check(bc.fit(CASES[case][0], "lambert + kurt", loss=loss))


@pytest.mark.parametrize("case", ["fewer samples than values", "all zero", "constant"])
def test_so_it_is_with_other_optimizers(case: str) -> None:
    for optimizer in ("least_squares", "lbfgs"):
        check(bc.fit(CASES[case][0], "lambert + ward_bounded", optimizer=optimizer))


def test_values_whose_squares_leave_the_type_are_refused() -> None:
    extremes = bc.Samples(
        WI, WO, torch.cat([RANDOM[:1], 1e-200 * RANDOM[1:]])
    )  # the relative loss divides by small ones
    with pytest.raises(SamplesError, match=r"^Expected values to be of a size whose squares a double holds") as caught:
        bc.fit(extremes, "lambert + kurt", loss="relative")
    assert caught.value.field == "values"


EXTREME = {
    "values": (
        bc.Samples(WI, WO, 1e160 * RANDOM),
        {},
        "the largest of values from 1e-110 to 1e+110, got 9.41e+159. Choose",
    ),
    "small values": (bc.Samples(WI, WO, 1e-160 * RANDOM), {}, "got 9.41e-161. Choose another unit."),
    "sigma": (
        bc.Samples(WI, WO, RANDOM, sigma=RANDOM * 1e-200),
        {},
        "the largest of sigma from 1e-110 to 1e+110, got 9.41e-201.",
    ),
    "large sigma": (bc.Samples(WI, WO, RANDOM, sigma=RANDOM * 1e200), {}, "got 9.41e+199. Give sigma in the unit"),
    "their ratio": (
        bc.Samples(WI, WO, 1e70 * RANDOM, sigma=RANDOM * 1e-70),
        {},
        "the largest of values over sigma from 1e-110 to 1e+110, got 1e+140.",
    ),
    "weight": (bc.Samples(WI, WO, RANDOM, weight=1e200 * RANDOM[:, 0]), {}, "Divide all weights by the largest."),
    "robust_scale": (
        bc.Samples(WI, WO, RANDOM),
        {"robust": "cauchy", "robust_scale": 1e-300},
        "from 1e-10 to 1e+110 times what the largest value counts under the cosine loss, 0.",
    ),
    "large robust_scale": (bc.Samples(WI, WO, RANDOM), {"robust": "soft_l1", "robust_scale": 1e300}, "got 1e+300."),
}


@pytest.mark.parametrize("case", EXTREME)
def test_what_is_of_no_size_is_named_before_any_work(case: str) -> None:
    """In a batch too, so that one material of many does not lose what was done for the others."""
    samples, keywords, part = EXTREME[case]
    good, seen = bc.Samples(WO, WI, RANDOM), []
    for call in (
        lambda: bc.fit(samples, "lambert + ward_bounded", **keywords),
        lambda: bc.fit_batch([good, samples], "lambert + ward_bounded", progress=seen.append, **keywords),
    ):
        with pytest.raises(InvalidValueError) as caught:
            call()
        assert str(caught.value).startswith(f"Expected {caught.value.field} to be ")
        assert caught.value.field == case.split()[-1].replace("ratio", "sigma")
        assert part in str(caught.value)
    assert seen == []


@pytest.mark.parametrize("model", ["lambert", "lambert + ward_bounded", "lambert + kurt"])
def test_values_beyond_any_reflectance_are_told(model: str) -> None:
    """In percent, or in counts; and not where a lobe alone is missing, or values are fixed."""
    good = measured_from(TRUE, count=80, noise=0.01)

    def told(factor: float, **keywords: object) -> bool:
        samples = bc.Samples(good.wi, good.wo, factor * good.values)
        return any("Check the unit and the quantity" in one for one in bc.fit(samples, model, **keywords).warnings)

    assert [told(factor) for factor in (math.pi, 100, 1e8)] == [False, True, True]
    form = bc.fit(good, model).form
    assert not told(100, fixed=dict.fromkeys(form.parameters, 0.5))


def test_what_stops_early_is_not_sent_to_what_it_used(monkeypatch: pytest.MonkeyPatch) -> None:
    samples = measured_from(TRUE, noise=0.01)
    one_step = {"max_iterations": 1}
    for name in ("least_squares", "variable_projection"):
        stop = getattr(search, name)
        monkeypatch.setattr(search, name, lambda *a, stop=stop, **k: stop(*a, **{**k, **one_step}))
    for optimizer in ("auto", "least_squares"):
        fit = bc.fit(samples, "lambert + kurt", optimizer=optimizer)
        assert fit.status == "stopped_early"
        assert "least_squares" not in fit.message
        assert "give starts near it" in fit.message
    monkeypatch.setitem(vars(search), "lbfgs", lambda *a, **k: lbfgs(*a, **{**k, "max_iterations": 1}))
    assert "use least_squares" in bc.fit(samples, "lambert + kurt", optimizer="lbfgs").message


@pytest.mark.parametrize(
    "case",
    [
        "one direction",
        "all zero",
        *(pytest.param(c, marks=pytest.mark.full) for c in CASES if c not in ("one direction", "all zero")),
    ],
)
def test_so_it_is_for_robust_forms_and_a_known_sigma(case: str) -> None:
    samples, _ = CASES[case]
    check(bc.fit(samples, "lambert + ward_bounded", robust="cauchy"))
    sigma = samples.values.abs() * 0.01 + 1e-3
    check(bc.fit(bc.Samples(samples.wi, samples.wo, samples.values, sigma=sigma), "lambert + ward_bounded"))


def test_two_samples_leave_combinations_of_three_values() -> None:
    fit = bc.fit(CASES["fewer samples than values"][0], "lambert + ward_bounded(isotropic)")
    assert fit.status == "undetermined"
    assert fit.undetermined
    assert fit.covariance_keys == ()
    assert fit.to_dict()["covariance"] is None


def test_one_direction_determines_a_sum() -> None:
    fit = bc.fit(CASES["one direction"][0], "lambert + ward_bounded(isotropic)")
    assert fit.status == "undetermined"
    assert bool(fit.parameters["lambert.kd"].isnan())
    assert "one by one, only together" in fit.message
    alone = bc.fit(CASES["one direction"][0], "lambert")
    assert alone.status == "converged"
    assert float(RANDOM.mean()) > 1 / math.pi
    assert float(alone.parameters["lambert.kd"]) == 1, "the mean of the values is above that of a white surface"


@pytest.mark.parametrize("name", ["chassis", "solar_array"])
@pytest.mark.parametrize("loss", ["cosine", "log"])
def test_the_dynamic_range_of_satellites(measured: pathlib.Path, name: str, loss: str) -> None:
    """Peaks up to 5e4 over values of 1e-4."""
    rows = np.loadtxt(measured / "satellite" / f"{name}_brdf.csv")
    rows = rows[np.abs(rows[:, 2]) < 90]
    theta_i, phi_i, theta_o, phi_o, values = rows.T
    samples = bc.Samples.from_angles(theta_i, phi_i, theta_o, phi_o, values, "degrees")
    for model in ("lambert + ward_bounded", "lambert + kurt"):
        fit = bc.fit(samples, model, loss=loss)
        check(fit)
        assert any("times the median" in sentence for sentence in fit.warnings) == (loss == "cosine")


def test_healthy_data_need_no_sentence() -> None:
    assert bc.fit(measured_from(TRUE, noise=0.01), "lambert + ward_bounded").warnings == ()
    assert bc.fit(one_incidence(), "lambert").warnings == ()
