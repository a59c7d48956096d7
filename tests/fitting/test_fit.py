"""`bc.fit` as a user calls it."""

import json
import math

import pytest
import torch
from fit_cases import TRUE, directions, measured_from

import brdfcore as bc
from brdfcore.demo import DATA
from brdfcore.errors import BrdfError
from brdfcore.fitting import check
from brdfcore.fitting.adam import adam
from brdfcore.fitting.every_error import errors
from brdfcore.fitting.problem import Problem
from brdfcore.fitting.result import STATUSES

MODEL = "lambert + ward_bounded(isotropic)"


@pytest.fixture(scope="module")
def three_channels() -> bc.Samples:
    return measured_from(TRUE)


@pytest.mark.parametrize("loss", bc.LOSSES)
def test_noiseless_data_give_the_parameters_back(three_channels: bc.Samples, loss: str) -> None:
    fit = bc.fit(three_channels, MODEL, loss=loss)
    assert fit.status == "converged"
    true = bc.material(TRUE).values()
    for key, value in fit.parameters.items():
        torch.testing.assert_close(value, true[key].detach(), rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("optimizer", bc.OPTIMIZERS)
def test_every_optimizer_reaches_the_same_optimum(optimizer: str) -> None:
    """The gradient methods begin at the scan's raw points, which lie well above the optimum."""
    samples = measured_from(TRUE, noise=0.01)
    seen: list[bc.Progress] = []
    best = bc.fit(samples, MODEL).objective
    fit = bc.fit(samples, MODEL, optimizer=optimizer, progress=seen.append)
    if optimizer in ("lbfgs", "adam"):
        assert max(p.loss for p in seen if p.stage == "fit") > 1.05 * best
    assert fit.status == "converged"
    assert fit.objective == pytest.approx(best, rel=1e-8)
    assert fit.cost.optimizer == ("variable_projection" if optimizer == "auto" else optimizer)


BENT = "lambert(kd=0.1) + kurt(anisotropic, ks=0.4, f0=0.2, mx=0.15, my=0.3, alpha=0.25)"


@pytest.mark.parametrize("data", ["measured", pytest.param("bent", marks=pytest.mark.full)])
@pytest.mark.parametrize("optimizer", ["lbfgs", "adam"])
def test_gradient_methods_get_through_bent_valleys(optimizer: str, data: str) -> None:
    """Where ks f0 is known better than either, the way along it is long; real data, and a material of six shapes."""
    samples = bc.read(DATA) if data == "measured" else measured_from(BENT, noise=0.01)
    fit = bc.fit(samples, "lambert + kurt", optimizer=optimizer)
    assert fit.status != "stopped_early"
    assert fit.objective == pytest.approx(bc.fit(samples, "lambert + kurt").objective, rel=1e-7)
    assert fit.cost.evaluations < 5000


def test_adam_without_the_steps_that_it_needs_stops_early() -> None:
    problem = Problem(check(1, "lambert + kurt"), bc.read(DATA), bc.LOSSES["cosine"])
    ended = adam(problem, problem.pack(problem.plan.start).unsqueeze(0), max_iterations=30)
    assert ended.iterations == 30
    assert not bool(ended.converged)


MATERIALS = {
    "ward": "lambert(kd=0.2) + ward(isotropic, rs=0.1, a=0.15)",
    "ward_duer": "lambert(kd=0.2) + ward_duer(anisotropic, rs=0.1, ax=0.1, ay=0.3)",
    "ward_neumann": "lambert(kd=0.2) + ward_neumann(isotropic, rs=0.2, a=0.2)",
    "kurt": "lambert(kd=0.1) + kurt(anisotropic, ks=0.4, f0=0.2, mx=0.15, my=0.3, alpha=0.25)",
    "kurt constant": "lambert(kd=0.1) + kurt(isotropic, constant, ks=0.1, m=0.15, alpha=0.25)",
    "kurt_plausible": "coupled_lambert(kd=0.3, f0=kurt_plausible.f0)"
    " + kurt_plausible(isotropic, ks=0.5, f0=0.3, m=0.2)",
    "A&S": "ashikhmin_shirley(anisotropic, f0=0.3, nu=50, nv=400)"
    " + ashikhmin_shirley_diffuse(kd=0.4, f0=ashikhmin_shirley.f0)",
    "A&S scaled": "lambert(kd=0.1) + ashikhmin_shirley(isotropic, scaled, ks=0.6, f0=0.2, n=80)",
    "two lobes": "lambert(kd=0.1) + ward_bounded(isotropic, rs=0.1, a=0.08) + ward_bounded(isotropic, rs=0.2, a=0.4)",
}


@pytest.mark.parametrize("name", MATERIALS)
def test_every_form_is_found_from_a_scan(name: str) -> None:
    text = MATERIALS[name]
    true = bc.material(text)
    samples = measured_from(text, count=400)
    fit = bc.fit(samples, true.form.text(), seed=3)
    assert fit.errors["cosine_rms"] < 1e-9 * float(samples.values.abs().max()), fit.report()


def test_rebuilt_material_has_the_residual_that_the_solver_claims() -> None:
    samples = measured_from(TRUE, noise=0.05)
    for text in ("lambert + ward_bounded", "lambert(kd=[0.2, 0.4, 0.6] - ward.rs) + ward(isotropic)", "kurt"):
        fit = bc.fit(samples, text)
        rebuilt = bc.material(str(fit.material))
        c = samples.wi[:, 2:]
        claimed = (c * (rebuilt.f(samples.wi, samples.wo) - samples.values)).square().sum()
        assert float(claimed.detach()) == pytest.approx(fit.objective, rel=1e-9)
        assert fit.errors["cosine"] == pytest.approx(fit.objective, rel=1e-12)


def test_values_in_the_text_are_starts_and_fixed_ones_stay(three_channels: bc.Samples) -> None:
    started = bc.fit(three_channels, "lambert + ward_bounded(isotropic, a=0.5)")
    assert float(started.parameters["ward_bounded.a"]) == pytest.approx(0.12, rel=1e-6)
    fixed = bc.fit(three_channels, MODEL, fixed={"ward_bounded.a": 0.2, "lambert.kd": [0.1, 0.2, 0.3]})
    assert float(fixed.parameters["ward_bounded.a"]) == pytest.approx(0.2, rel=1e-15)
    assert fixed.parameters["lambert.kd"].tolist() == pytest.approx([0.1, 0.2, 0.3], rel=1e-15)
    assert bool(fixed.intervals["ward_bounded.a"].isnan().all())


def test_gray_keeps_one_value(three_channels: bc.Samples) -> None:
    fit = bc.fit(three_channels, MODEL, gray=("ward_bounded.rs",))
    assert fit.parameters["ward_bounded.rs"].shape == ()
    assert fit.parameters["lambert.kd"].shape == (3,)


def test_everything_fixed_is_an_evaluation(three_channels: bc.Samples) -> None:
    fit = bc.fit(
        three_channels,
        "lambert + ward_bounded(isotropic)",
        fixed={"lambert.kd": 0.2, "ward_bounded.rs": 0.1, "ward_bounded.a": 0.1},
    )
    assert fit.status == "converged"
    assert fit.objective == pytest.approx(fit.errors["cosine"], rel=1e-12)


def test_tie_to_a_known_total_holds_exactly() -> None:
    samples = measured_from("lambert(kd=0.12) + ward_bounded(isotropic, rs=0.05, a=0.1)", noise=0.003)
    fit = bc.fit(samples, "lambert(kd=0.17 - ward_bounded.rs) + ward_bounded")
    kd, rs = fit.parameters["lambert.kd"], fit.parameters["ward_bounded.rs"]
    assert float(kd + rs) == pytest.approx(0.17, abs=1e-15)
    low, high = fit.intervals["ward_bounded.rs"]
    assert fit.intervals["lambert.kd"].tolist() == pytest.approx([0.17 - float(high), 0.17 - float(low)], abs=1e-15)


def test_the_same_seed_gives_the_same_result_to_the_last_digit() -> None:
    samples = measured_from(TRUE, noise=0.05)
    first, second = (bc.fit(samples, MODEL, seed=7).to_dict() for _ in range(2))
    for result in (first, second):
        result["cost"].pop("seconds")
        result["certificate"].pop("seconds")
        result.pop("report")
    assert first == second


def test_a_parameter_that_the_data_cannot_show_gets_no_number() -> None:
    """Without a lobe in the data its width is free."""
    samples = measured_from("lambert(kd=0.2)", count=100)
    fit = bc.fit(samples, "lambert + ward_bounded(isotropic)")
    assert "ward_bounded.a" in fit.undetermined
    assert bool(fit.parameters["ward_bounded.a"].isnan())
    assert bool(fit.intervals["ward_bounded.a"].isnan().all())
    assert "do not determine ward_bounded.a" in fit.message
    assert fit.to_dict()["parameters"]["ward_bounded.a"] is None
    assert float(fit.parameters["lambert.kd"]) == pytest.approx(0.2, rel=1e-9)


def test_two_equal_terms_are_named_as_undetermined() -> None:
    samples = measured_from("lambert(kd=0.2)", count=100, noise=0.01)
    fit = bc.fit(samples, "lambert + lambert")
    assert fit.undetermined == ("lambert.kd with lambert_2.kd",)


def test_a_value_on_its_bound_has_no_interval_and_is_said_to_be_there() -> None:
    samples = measured_from("ward_bounded(isotropic, rs=0.3, a=0.2)", noise=0.05, seed=4)
    shifted = bc.Samples(samples.wi, samples.wo, samples.values - 0.05)
    fit = bc.fit(shifted, MODEL)
    assert float(fit.parameters["lambert.kd"]) == 0
    assert bool(fit.intervals["lambert.kd"].isnan().all())
    assert not bool(fit.intervals["ward_bounded.rs"].isnan().any())
    assert "lambert.kd ended on an end of the box" in fit.message


def test_fewer_samples_than_values_gives_no_intervals() -> None:
    wi, wo = directions(2, 0)
    fit = bc.fit(bc.Samples(wi, wo, [[0.1], [0.4]]), "lambert + ward_bounded(isotropic)")
    assert all(bool(i.isnan().all()) for i in fit.intervals.values())
    assert math.isfinite(fit.objective)
    json.dumps(fit.to_dict(), allow_nan=False)


@pytest.mark.parametrize("value", [0.0, 1e-30, 1e30, -1.0])
@pytest.mark.parametrize("loss", bc.LOSSES)
def test_extreme_data_end_with_a_status_and_no_nan(value: float, loss: str) -> None:
    wi, wo = directions(30, 0)
    fit = bc.fit(bc.Samples(wi, wo, torch.full((30, 1), value)), "lambert + kurt(isotropic)", loss=loss)
    assert fit.status in STATUSES
    assert all(math.isfinite(error) for error in fit.errors.values())
    assert all(bool(v.isfinite().all()) for v in fit.material.values().values())


def test_result_is_json_and_names_what_made_it() -> None:
    samples = measured_from(TRUE, noise=0.05)
    fit = bc.fit(samples, MODEL, seed=5)
    result = json.loads(json.dumps(fit.to_dict(), allow_nan=False))
    assert result["provenance"] == {
        "version": bc.__version__,
        "torch": torch.__version__,
        "seed": 5,
        "input": samples.hash,
    }
    assert result["channels"] == ["r", "g", "b"]
    assert set(result["errors"]) == {*bc.LOSSES, "cosine_rms"}
    assert str(bc.Material.from_json(result["material"])) == str(fit.material) == result["material_text"]
    assert result["cost"]["seconds"] > 0
    assert result["cost"]["starts"] > 1
    assert "lambert.kd[r]" in result["report"]
    assert result["report"] == fit.report()


def test_progress_rises_to_one(three_channels: bc.Samples) -> None:
    seen: list[bc.Progress] = []
    bc.fit(three_channels, MODEL, loss="log", progress=seen.append)
    fractions = [p.fraction for p in seen]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert seen[0].stage == "scan"
    assert {"fit", "uncertainty", "done"} <= {p.stage for p in seen}


def test_the_result_names_what_was_fixed_gray_and_per_channel(three_channels: bc.Samples) -> None:
    fit = bc.fit(
        three_channels,
        "lambert + kurt(isotropic)",
        fixed={"kurt.alpha": 0.1},
        gray=["lambert.kd"],
        per_channel=["kurt.f0"],
    ).to_dict()
    assert (fit["fixed"], fit["gray"], fit["per_channel"]) == (["kurt.alpha"], ["lambert.kd"], ["kurt.f0"])
    (line,) = [line for line in fit["report"].splitlines() if line.startswith("kurt.alpha")]
    assert "  fixed " in line


def test_other_losses_find_the_optimum_that_some_start_finds() -> None:
    """Starts are ranked under the loss that is minimised, not under the cosine loss alone."""
    samples = measured_from("coupled_lambert(kd=0.3, f0=kurt.f0) + kurt(isotropic, ks=0.5, f0=0.05, m=0.3)", noise=0.01)
    text = "coupled_lambert(f0=kurt.f0) + kurt(isotropic{})"
    found = bc.fit(samples, text.format(""), loss="cube_root").objective
    by_hand = [bc.fit(samples, text.format(f", m={m}"), loss="cube_root").objective for m in (0.02, 0.1, 0.3, 0.6)]
    assert found <= 1.0001 * min(by_hand)


def test_bounds_hold_and_starts_lead_to_their_optimum() -> None:
    samples = measured_from("lambert(kd=0.1) + ward_bounded(isotropic, rs=0.1, a=0.3)", noise=0.01)
    for loss in bc.LOSSES:
        fit = bc.fit(samples, MODEL, loss=loss, bounds={"ward_bounded.a": (0.01, 0.2), "lambert.kd": (0.15, 1.0)})
        assert 0.01 <= float(fit.values["ward_bounded.a"]) <= 0.2 * (1 + 1e-15)
        assert float(fit.values["lambert.kd"]) >= 0.15
    free = bc.fit(samples, MODEL)
    assert bc.fit(samples, MODEL, starts=[{"ward_bounded.a": 5.0}]).objective == pytest.approx(free.objective, rel=1e-9)
    assert bc.fit(samples, MODEL, starts=[{}]).cost.starts == free.cost.starts + 1


def test_steep_samples_are_left_out_and_counted(three_channels: bc.Samples) -> None:
    limit = math.radians(60)
    fit = bc.fit(three_channels, MODEL, max_theta=limit)
    kept = (three_channels.wi[:, 2] >= math.cos(limit)) & (three_channels.wo[:, 2] >= math.cos(limit))
    same = bc.fit(three_channels.subset(kept), MODEL)
    assert fit.objective == same.objective
    report = fit.to_dict()["data"]
    assert report["samples"] == int(kept.sum())
    assert report["masked"] == [{"reason": "a direction steeper than 60 degrees", "count": int((~kept).sum())}]
    assert "a direction steeper than 60 degrees" in fit.report()
    with pytest.raises(BrdfError, match=r"^Expected max_theta to leave at least one sample, got 0\.001 radians"):
        bc.fit(three_channels, MODEL, max_theta=0.001)


def test_samples_must_be_samples() -> None:
    with pytest.raises(
        BrdfError, match=r"^Expected samples to be Samples, got str\. Make them with bc\.read"
    ) as caught:
        bc.fit("garnet_red.brdf", "lambert")
    assert caught.value.field == "samples"


def test_bad_arguments_are_refused_before_work(three_channels: bc.Samples) -> None:
    with pytest.raises(BrdfError, match="Expected a model"):
        bc.fit(three_channels, "lambert + wrad")


def test_large_data_use_a_subset_for_starts_and_all_of_it_for_the_result() -> None:
    samples = measured_from(TRUE, count=6000, noise=0.01)
    fit = bc.fit(samples, MODEL)
    assert fit.status == "converged"
    half = bc.fit(samples.subset(torch.arange(3000)), MODEL)
    assert fit.standard_errors["ward_bounded.a"] < 0.9 * half.standard_errors["ward_bounded.a"]


def test_errors_under_other_losses_are_computed_when_they_are_read(three_channels: bc.Samples) -> None:
    fit = bc.fit(three_channels, MODEL)
    assert "errors" not in vars(fit)
    assert fit.errors == pytest.approx(errors(fit.material, three_channels), abs=1e-12)
    assert set(fit.errors) == {*bc.LOSSES, "cosine_rms"}
    assert "errors" in vars(fit)
