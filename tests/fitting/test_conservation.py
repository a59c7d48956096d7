"""Fits that keep the directional albedo at 1 or below, and what that costs in error."""

import math

import numpy as np
import pytest
import torch
from scipy.optimize import minimize

import brdfcore as bc
from brdfcore.errors import ParameterError


def noisy(text: str, azimuths: tuple[float, ...] = (0.0,), seed: int = 0) -> bc.Samples:
    """Samples of a material in planes of incidence, with 2 % noise."""
    theta_i, theta_o, phi = torch.meshgrid(
        torch.tensor([0.0, 15, 30, 45, 60, 75]).double().deg2rad(),
        torch.linspace(-85, 85, 35).double().deg2rad(),
        torch.tensor(azimuths).double(),
        indexing="ij",
    )

    def direction(theta: torch.Tensor) -> torch.Tensor:
        return torch.stack([theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()], -1).reshape(-1, 3)

    wi, wo = direction(theta_i), direction(-theta_o)
    with torch.no_grad():
        f = bc.material(text).f(wi, wo)
    noise = torch.randn(f.shape, dtype=torch.float64, generator=torch.Generator().manual_seed(seed))
    return bc.Samples(wi, wo, (f * (1 + 0.02 * noise)).clamp(min=0), azimuth_observed=len(azimuths) > 1)


CASES = {
    "at the horizon": ("lambert(kd=0.5) + ggx(constant, ks=0.9, a=0.2)", "lambert + ggx(constant)", (0.0,)),
    "coloured": ("lambert(kd=[0.5, 0.7, 0.1]) + ggx(ks=0.9, f0=0.6, a=0.2)", "lambert + ggx", (0.0,)),
    "grooves": ("lambert(kd=0.5) + cook_torrance(ks=0.9, f0=0.8, a=0.3)", "lambert + cook_torrance", (0.0,)),
    "inside": ("lambert(kd=0.6) + ward_neumann(rs=0.9, a=0.5)", "lambert + ward_neumann", (0.0,)),
    "anisotropic": (
        "lambert(kd=0.6) + ward_bounded(rs=0.7, ax=0.4, ay=0.1)",
        "lambert + ward_bounded",
        (0.0, 0.8, 1.6),
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_what_exceeds_1_ends_at_1(case):
    truth, model, azimuths = CASES[case]
    samples = noisy(truth, azimuths)
    free, kept = bc.fit(samples, model), bc.fit(samples, model, conserve_energy=True)
    assert free.certificate.max_albedo > 1.01
    assert kept.status == "converged"
    assert 1 - 1e-5 < kept.certificate.max_albedo <= 1 + 1e-6
    assert kept.objective > free.objective
    assert kept.conservation.free_objective == pytest.approx(free.objective, rel=1e-9)
    assert kept.conservation.free_max_albedo == pytest.approx(free.certificate.max_albedo, rel=1e-6)
    assert f"instead of {free.objective:.4g}" in kept.message
    assert kept.to_dict()["conservation"]["directions"] == kept.conservation.directions >= 1


def test_intervals_lie_along_the_limit():
    """At the horizon kd + ks = 1, so that what one gains the other loses, and both are surer than they were."""
    samples = noisy(CASES["at the horizon"][0])
    free, kept = (bc.fit(samples, "lambert + ggx(constant)", conserve_energy=asked) for asked in (False, True))
    at = [kept.covariance_keys.index(key) for key in ("lambert.kd", "ggx.ks")]
    assert float(kept.correlations[at[0], at[1]]) < -0.99
    assert float(free.correlations[at[0], at[1]]) > -0.9


@pytest.mark.full
def test_no_other_optimiser_finds_less():
    """scipy's SLSQP under the albedos at 30 angles, from our own result and from another: within 1e-3 of our loss."""
    samples = noisy("lambert(kd=0.6) + ward_neumann(rs=0.9, a=0.5)")
    found = bc.fit(samples, "lambert + ward_neumann", conserve_energy=True)
    cosine = torch.cos(torch.linspace(0, math.pi / 2, 31, dtype=torch.float64)[:-1])
    form, keys = found.form, list(found.parameters)

    def values(x: np.ndarray) -> dict[str, torch.Tensor]:
        return dict(zip(keys, torch.tensor(x, dtype=torch.float64).unbind(), strict=True))

    def loss(x: np.ndarray) -> float:
        with torch.no_grad():
            f = bc.Material(form, values(x)).f(samples.wi, samples.wo)
        return float((samples.wi[:, 2:] * (f - samples.values)).square().sum())

    def room(x: np.ndarray) -> np.ndarray:
        return 1 - bc.energy.albedo.of_form(form, values(x), cosine, torch.zeros(()), 1e-6).values[:, 0].numpy()

    ours = np.array([float(found.parameters[key]) for key in keys])
    assert loss(ours) == pytest.approx(found.objective, rel=1e-9)
    for start in (ours, [0.2, 0.2, 0.8]):
        other = minimize(
            loss, start, method="SLSQP", bounds=[(0, 1), (0, 1), (0.01, 3)], constraints={"type": "ineq", "fun": room}
        )
        assert other.fun >= found.objective * (1 - 1e-3)
    assert other.fun == pytest.approx(found.objective, rel=1e-2)  # and it does get there


def test_what_conserves_energy_anyway_costs_nothing():
    samples = noisy("lambert(kd=0.2) + ward_bounded(rs=0.3, a=0.2)")
    free, kept = (
        bc.fit(samples, "lambert + ward_bounded"),
        bc.fit(samples, "lambert + ward_bounded", conserve_energy=True),
    )
    assert kept.parameters == free.parameters
    assert kept.conservation.directions == 0
    assert "so that cost nothing" in kept.message
    assert free.conservation is None


def test_a_power_that_grows_without_limit_is_fixed():
    """Kurt's lobe has a bounded albedo at alpha = 0 only."""
    samples = noisy("lambert(kd=0.1) + kurt(ks=0.5, f0=0.3, m=0.2, alpha=0.3)")
    kept = bc.fit(samples, "lambert + kurt", conserve_energy=True)
    assert kept.conservation.fixed == ("kurt.alpha",)
    assert kept.conservation.free_max_albedo == math.inf
    assert float(kept.parameters["kurt.alpha"]) == 0
    assert kept.certificate.max_albedo <= 1 + 1e-6
    assert "It fixed kurt.alpha, without which the albedo has no limit towards grazing." in kept.message
    assert kept.to_dict()["conservation"]["free_max_albedo"] is None


def test_a_lobe_that_always_grows_without_limit_reflects_nothing():
    kept = bc.fit(noisy("lambert(kd=0.2) + ward(rs=0.3, a=0.2)"), "lambert + ward", conserve_energy=True)
    assert kept.conservation.fixed == ("ward.rs",)
    assert float(kept.parameters["ward.rs"]) == 0
    assert kept.certificate.energy_conserving


def test_what_is_fixed_above_1_says_so():
    samples = noisy("lambert(kd=0.2) + ward(rs=0.3, a=0.2)")
    kept = bc.fit(samples, "lambert + ward", fixed={"ward.rs": 0.3}, conserve_energy=True)
    assert kept.status == "stopped_early"
    assert kept.message.endswith(
        "The largest albedo still exceeds 1: free what is fixed, or choose a lobe of bounded albedo."
    )
    kept = bc.fit(
        samples, "lambert + ward_bounded", fixed={"lambert.kd": 0.9, "ward_bounded.rs": 0.5}, conserve_energy=True
    )
    assert kept.status == "stopped_early"


def test_a_batch_gives_what_each_gives_alone():
    several = [
        noisy("lambert(kd=0.5) + ggx(constant, ks=0.9, a=0.2)"),
        noisy("lambert(kd=0.2) + ggx(constant, ks=0.2, a=0.3)"),
    ]
    batch = bc.fit_batch(several, "lambert + ggx(constant)", conserve_energy=True)
    for one, samples in zip(batch, several, strict=True):
        alone = bc.fit(samples, "lambert + ggx(constant)", conserve_energy=True)
        for key, value in alone.parameters.items():
            assert float(one.parameters[key]) == pytest.approx(float(value), rel=1e-5)
        assert one.conservation.directions == alone.conservation.directions


def test_conserve_energy_is_a_truth_value():
    with pytest.raises(ParameterError, match=r"Expected conserve_energy to be true or false, got 'yes'\. Pass one of"):
        bc.fit(noisy("lambert(kd=0.2)"), "lambert", conserve_energy="yes")


def test_the_verdict_names_the_datas_channel() -> None:
    values = torch.tensor([[0.05, 0.1]] * 3)
    samples = bc.Samples.from_angles(
        [10, 30, 50], 0, [20, 40, 60], 180, values, "degrees", channels=("450 nm", "550 nm")
    )
    assert bc.fit(samples, "lambert").certificate.verdict.endswith(" at normal incidence in channel 550 nm.")
