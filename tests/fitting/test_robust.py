"""Robust forms: their equations, their derivatives, and what they are for."""

import json
import math

import pytest
import scipy.optimize
import torch
from fit_cases import measured_from

import brdfcore as bc
from brdfcore.fitting.losses import LOSSES
from brdfcore.fitting.plan import check
from brdfcore.fitting.problem import Problem
from brdfcore.fitting.robust import ROBUST, softened

TRUE = "lambert(kd=0.2) + ward_bounded(isotropic, rs=0.1, a=0.15)"
MODEL = "lambert + ward_bounded(isotropic)"


def spoiled(count: int = 300) -> bc.Samples:
    """Good samples, of which every tenth reads five times too high."""
    good = measured_from(TRUE, count=count, noise=0.003)
    values = good.values.clone()
    values[::10] *= 5
    return bc.Samples(good.wi, good.wo, values)


@pytest.mark.parametrize("name", ROBUST)
def test_the_forms_are_scipys(name: str) -> None:
    z = torch.logspace(-8, 8, 50, dtype=torch.float64)
    rho, first, second = ROBUST[name].functions(z)
    expected = {"soft_l1": 2 * (torch.sqrt(1 + z) - 1), "cauchy": torch.log(1 + z)}[name]  # scipy's documentation
    torch.testing.assert_close(rho, expected, rtol=1e-7, atol=0)
    leaf = z.clone().requires_grad_()
    (slope,) = torch.autograd.grad(ROBUST[name].functions(leaf)[0].sum(), leaf, create_graph=True)
    (bend,) = torch.autograd.grad(slope.sum(), leaf)
    torch.testing.assert_close(torch.stack([first, second]), torch.stack([slope.detach(), bend]), rtol=1e-7, atol=0)


@pytest.mark.parametrize("name", ROBUST)
def test_gauss_newton_sees_the_gradient_of_rho(name: str) -> None:
    r = torch.linspace(-5, 5, 41, dtype=torch.float64, requires_grad=True)
    scale = torch.tensor(0.7, dtype=torch.float64)
    rho, residual, root = softened(ROBUST[name], scale, r)
    (slope,) = torch.autograd.grad(rho.sum(), r)
    torch.testing.assert_close(2 * residual * root, slope)


@pytest.mark.parametrize("name", ROBUST)
def test_normal_noise_costs_a_twentieth_of_the_precision(name: str) -> None:
    """(E psi')^2 / E psi^2 under a normal distribution, by quadrature: 95 %."""
    r = torch.linspace(-10, 10, 40001, dtype=torch.float64, requires_grad=True)
    rho, _, _ = softened(ROBUST[name], torch.tensor(ROBUST[name].multiple, dtype=torch.float64), r)
    (psi,) = torch.autograd.grad(0.5 * rho.sum(), r, create_graph=True)
    slope = torch.autograd.grad(psi.sum(), r)[0].detach()
    density = torch.exp(-0.5 * r.detach() ** 2) / math.sqrt(2 * math.pi) * 20 / 40000
    assert float((slope * density).sum() ** 2 / (psi.detach() ** 2 * density).sum()) == pytest.approx(0.95, abs=1e-4)


@pytest.mark.parametrize("loss", bc.LOSSES)
@pytest.mark.parametrize("name", ROBUST)
def test_a_few_bad_samples_do_not_decide(name: str, loss: str) -> None:
    samples = spoiled()
    true = {key: value.detach() for key, value in bc.material(TRUE).values().items()}
    plain, robust = bc.fit(samples, MODEL, loss=loss), bc.fit(samples, MODEL, loss=loss, robust=name)
    assert robust.status == "converged"

    def off(fit: bc.Fit) -> float:
        return max(float((fit.parameters[key] / value - 1).abs()) for key, value in true.items())

    # bad samples that all err upwards still pull with a force that does not fall, soft_l1, or that does, cauchy
    assert off(robust) < {"soft_l1": 0.1, "cauchy": 0.03}[name]
    assert off(robust) < 0.7 * off(plain)


@pytest.mark.parametrize("name", ROBUST)
def test_a_fifth_of_gross_outliers_does_not_decide(name: str) -> None:
    """They inflate the spread about the plain optimum tenfold and more: one turn of spread and fit is not enough."""
    good = measured_from(TRUE, noise=0.003)
    values = good.values.clone()
    values[::5] *= 10
    fit = bc.fit(bc.Samples(good.wi, good.wo, values), MODEL, robust=name)
    for key, value in bc.material(TRUE).values().items():
        off = {"soft_l1": 0.12, "cauchy": 0.03}[name]
        assert float(fit.parameters[key]) == pytest.approx(float(value.detach()), rel=off), key


def test_the_scale_is_that_of_the_residuals_where_the_fit_ends() -> None:
    samples = spoiled()
    fit = bc.fit(samples, MODEL, robust="cauchy")
    r = samples.wi[:, 2:] * (fit.material.f(samples.wi, samples.wo).detach() - samples.values)
    scale = ROBUST["cauchy"].multiple * 1.4826 * float(r.abs().median())
    again = bc.fit(samples, MODEL, robust="cauchy", robust_scale=scale)
    assert fit.objective == pytest.approx(again.objective, rel=0.01)


def test_samples_of_weight_0_do_not_make_the_scale() -> None:
    """Most samples without weight, far off: the fit is that to the others alone."""
    good = spoiled()
    values, weight = good.values.clone(), torch.zeros(len(good))
    weight[:60] = 1
    values[60:] = 3
    whole = bc.fit(bc.Samples(good.wi, good.wo, values, weight=weight), MODEL, robust="cauchy")
    alone = bc.fit(good.subset(torch.arange(60)), MODEL, robust="cauchy")
    assert whole.objective == pytest.approx(alone.objective, rel=1e-6)
    for key, value in alone.parameters.items():
        torch.testing.assert_close(whole.parameters[key], value, rtol=1e-6, atol=0)


@pytest.mark.parametrize("name", ROBUST)
def test_a_sample_of_weight_2_is_one_that_is_there_twice(name: str) -> None:
    samples = spoiled()
    twice = torch.arange(len(samples)) % 3 == 0
    weight = 1 + twice.double()
    more = torch.cat([torch.arange(len(samples)), twice.nonzero()[:, 0]])
    weighted = bc.fit(bc.Samples(samples.wi, samples.wo, samples.values, weight=weight), MODEL, robust=name)
    repeated = bc.fit(samples.subset(more), MODEL, robust=name)
    assert weighted.objective == pytest.approx(repeated.objective, rel=1e-9)
    for key, value in repeated.parameters.items():
        torch.testing.assert_close(weighted.parameters[key], value, rtol=1e-6, atol=0)


@pytest.mark.parametrize("name", ROBUST)
def test_the_optimum_is_scipys_with_the_same_scale(name: str) -> None:
    samples, scale = spoiled(), 0.004
    fit = bc.fit(samples, MODEL, robust=name, robust_scale=scale)
    plan = check(1, MODEL)
    problem = Problem(plan, samples, LOSSES["cosine"])

    def residuals(x: object) -> object:
        f = problem.f(torch.as_tensor(x).unsqueeze(0), problem.data)
        return problem.residuals(f, problem.data, None)[1].reshape(-1).numpy()

    start = problem.pack(fit.values).numpy() + 0.01
    best = scipy.optimize.least_squares(residuals, start, loss=name, f_scale=scale, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    assert fit.objective == pytest.approx(2 * best.cost, rel=1e-9)
    assert fit.errors["cosine"] > fit.objective


def test_intervals_of_a_robust_fit_are_those_of_the_good_samples() -> None:
    samples = spoiled(1000)
    clean = torch.ones(1000, dtype=torch.bool)
    clean[::10] = False
    robust = bc.fit(samples, MODEL, robust="cauchy")
    plain, good = bc.fit(samples, MODEL), bc.fit(samples.subset(clean), MODEL)
    for key, error in good.standard_errors.items():
        assert 0.8 * float(error) < float(robust.standard_errors[key]) < 2 * float(error)
        assert float(robust.standard_errors[key]) < 0.2 * float(plain.standard_errors[key])


def test_exact_data_are_fitted_exactly() -> None:
    fit = bc.fit(measured_from(TRUE), MODEL, robust="cauchy")
    assert float(fit.parameters["ward_bounded.a"]) == pytest.approx(0.15, rel=1e-6)


def test_models_are_compared_at_one_scale() -> None:
    """That of the model that fits best, whose residuals are the smallest."""
    samples = spoiled()
    models = ["lambert", "lambert + blinn_phong", MODEL]
    compared = bc.compare(samples, models, robust="cauchy")
    assert compared.models[0] == MODEL
    assert len({fit.robust_scale for fit in compared.fits}) == 1
    assert compared.fits[0].robust_scale == pytest.approx(
        bc.fit(samples, MODEL, robust="cauchy").robust_scale, rel=0.02
    )
    given = bc.compare(samples, models, robust="cauchy", robust_scale=0.2)
    assert {fit.robust_scale for fit in given.fits} == {0.2}


def test_the_materials_of_a_ladder_are_compared_at_one_scale() -> None:
    samples = spoiled()
    fit = bc.fit(samples, ["lambert", MODEL], robust="cauchy")
    assert fit.model == bc.material(MODEL).form.text()
    own = bc.fit(samples, MODEL, robust="cauchy").robust_scale
    assert fit.robust_scale == pytest.approx(own, rel=0.02)
    lambert = bc.fit(samples, "lambert", robust="cauchy", robust_scale=fit.robust_scale)
    assert fit.ladder[0].error == pytest.approx(math.sqrt(lambert.objective / len(samples)), rel=1e-6)


def test_the_scale_of_an_exact_fit_may_be_given() -> None:
    exact = measured_from(TRUE, noise=0.0)
    scale = bc.fit(exact, TRUE, robust="cauchy").robust_scale
    assert scale is not None
    assert bc.fit(exact, TRUE, robust="cauchy", robust_scale=scale).robust_scale == scale


@pytest.mark.full
@pytest.mark.parametrize("noise", [0.003, 0.0])
def test_auto_sees_past_outliers(noise: float) -> None:
    """A fifth reads ten times too high; without noise, a shape that fits exactly must not make all others outliers."""
    good = measured_from(TRUE, noise=noise)
    values = good.values.clone()
    values[::5] *= 10 if noise else 1
    fit = bc.fit(bc.Samples(good.wi, good.wo, values), "auto", robust="cauchy")
    assert set(fit.parameters) >= {"lambert.kd"}
    assert len(fit.parameters) > 1
    assert float(fit.parameters["lambert.kd"]) == pytest.approx(0.2, rel=0.08)


def test_energy_is_conserved_at_the_scale_of_the_free_fit() -> None:
    samples = measured_from("lambert(kd=0.1) + kurt(isotropic, ks=0.5, f0=0.3, m=0.2, alpha=0.3)", noise=0.003)
    free = bc.fit(samples, "lambert + kurt(isotropic)", robust="cauchy")
    kept = bc.fit(samples, "lambert + kurt(isotropic)", robust="cauchy", conserve_energy=True)
    assert kept.conservation.fixed == ("kurt.alpha",)
    assert kept.robust_scale == free.robust_scale
    assert kept.conservation.free_objective == free.objective < kept.objective


def test_a_result_says_what_it_was_asked() -> None:
    good = measured_from(TRUE, noise=0.003, sigma=True)
    fit = bc.fit(
        good,
        MODEL,
        robust="cauchy",
        bounds={"ward_bounded.a": (0.1, 0.3)},
        starts=[{"ward_bounded.a": 0.2}],
        max_theta=math.radians(70),
    )
    options = json.loads(json.dumps(fit.to_dict(), allow_nan=False))["options"]
    assert options.pop("starts")[0]["ward_bounded.a"] == 0.2
    assert options == {
        "bounds": {"ward_bounded.a": [0.1, 0.3]},
        "robust": "cauchy",
        "robust_scale": fit.robust_scale,
        "max_theta_deg": pytest.approx(70),
        "conserve_energy": False,
    }
    assert 2 < fit.robust_scale < 3  # in sigma: 2.38 times a spread of one
    report = fit.report().splitlines()
    assert f"robust: cauchy, residuals beyond {fit.robust_scale:.4g} sigma count less" in report
    assert "bounds: ward_bounded.a [0.1, 0.3]" in report
    assert "starts given: 1" in report
    assert "directions up to 70 degrees" in report
    assert fit.weighed
    assert "Residuals were counted in sigma and made cauchy, so the minimised loss is not chi-square." in fit.message
    assert "the minimised loss is chi-square" not in fit.message
    plain = bc.fit(good, MODEL)
    assert plain.robust_scale is None
    assert "robust" not in plain.report()


def test_models_of_data_that_are_all_zero_are_compared() -> None:
    given = measured_from(TRUE, count=50)
    zero = bc.Samples(given.wi, given.wo, torch.zeros(50, dtype=torch.float64))
    assert bc.compare(zero, ["lambert", TRUE], robust="cauchy").best.objective == 0
    assert bc.fit(zero, ["lambert", TRUE], robust="cauchy").objective == 0


def test_the_samples_that_tell_starts_apart_have_weight() -> None:
    many, weight = measured_from(TRUE, count=4000, noise=0.003), torch.zeros(4000, dtype=torch.float64)
    weight[torch.randperm(4000, generator=torch.Generator().manual_seed(0))[3000:3100]] = 1.0
    some = bc.Samples(many.wi, many.wo, many.values, weight=weight)
    compared = bc.compare(some, ["lambert", "lambert + ward_bounded(isotropic)"], robust="cauchy")
    assert float(compared.best.parameters["lambert.kd"]) == pytest.approx(0.2, rel=0.02)


def test_held_out_errors_say_how_a_robust_form_counts_them() -> None:
    samples = measured_from(TRUE, count=60, noise=0.003)
    found = bc.held_out(samples, "lambert", robust="cauchy", robust_scale=0.25)
    assert (found.robust, found.robust_scale) == ("cauchy", 0.25)
    assert "the cosine loss's residual, as cauchy counts those beyond 0.25, 5 folds" in str(found)
    assert ", as " not in str(bc.held_out(samples, "lambert"))
