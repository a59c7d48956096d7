"""What the data leave free is named, alone or in combination, and gets no number; the rest keeps honest ones."""

import json
import math
import pathlib

import pytest
import torch
from fit_cases import TRUE, directions, measured_from
from reconstruction import merl_reconstruction

import brdfcore as bc
from brdfcore.fitting import fit_batch
from brdfcore.fitting.identifiability import Spectrum, _sparse, unseen
from brdfcore.formats import merl
from brdfcore.geometry import from_angles

FRESNEL = {
    "kurt": "kurt(isotropic, ks=0.4, f0=0.1, m=0.15, alpha=0.2)",
    "kurt_plausible": "kurt_plausible(isotropic, ks=0.4, f0=0.1, m=0.15)",
    "ggx": "ggx(isotropic, schlick, ks=0.4, f0=0.1, a=0.15)",
}


def noisy(text: str, wi: torch.Tensor, wo: torch.Tensor, noise: float, seed: int = 1) -> bc.Samples:
    """Samples of a material with noise as a share of the value, the sample never turned."""
    with torch.no_grad():
        f = bc.material(text).f(wi, wo)
    factor = 1 + noise * torch.randn(f.shape, generator=torch.Generator().manual_seed(1000 + seed), dtype=f.dtype)
    return bc.Samples(wi, wo, f * factor, azimuth_observed=False)


def half_angle_grid(text: str, noise: float) -> bc.Samples:
    """Some bins of MERL's grid: theta_h, theta_d and phi_d vary, the half vector never leaves the x-z plane."""
    wi, wo = (torch.from_numpy(w) for w in merl.grid()[:2])
    above = ((wi[:, 2] > 0.05) & (wo[:, 2] > 0.05)).nonzero()[:, 0]
    chosen = above[torch.randperm(len(above), generator=torch.Generator().manual_seed(0))[:1500]]
    return noisy(text, wi[chosen], wo[chosen], noise)


def steep_less(text: str, limit: float, seed: int = 1) -> bc.Samples:
    """300 samples with both directions within so many degrees of the normal, half of them near the mirror's."""
    u = torch.rand(4, 300, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)
    theta, near = math.radians(limit) * u[0], torch.arange(300) % 2 == 0
    theta_o = torch.where(near, (theta + 0.2 * (u[1] - 0.5)).abs(), math.radians(limit) * u[2])
    phi_o = torch.where(near, math.pi + 0.3 * (u[3] - 0.5), 2 * math.pi * u[3])
    return noisy(text, from_angles(theta, 0 * theta), from_angles(theta_o, phi_o), 0.02, seed)


def test_bounds_within_the_noise_leave_a_value_undetermined() -> None:
    """Bounds of twice the interval's length without bounds leave something to tell, those of a third do not."""
    samples = measured_from("lambert(kd=0.2)", count=100, noise=0.002)
    low, high = bc.fit(samples, "lambert").intervals["lambert.kd"].tolist()
    length, middle = high - low, (high + low) / 2

    def within(share: float) -> bc.Fit:
        half = share * length / 2
        return bc.fit(samples, "lambert", bounds={"lambert.kd": (middle - half, middle + half)})

    assert within(2).undetermined == ()
    assert within(0.3).undetermined == ("lambert.kd",)


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_an_anisotropic_lobe_on_isotropic_data_is_determined_only_together(noise: float) -> None:
    """Ward's lobe over the x-z plane of half vectors is a function of ax and of rs/ay: one direction is free."""
    samples = half_angle_grid(TRUE, noise)
    fit = bc.fit(samples, "lambert + ward_bounded(anisotropic)")
    assert fit.status == "undetermined"
    assert fit.undetermined == ("ward_bounded.ay with ward_bounded.rs",)
    assert "do not determine ward_bounded.ay with ward_bounded.rs one by one, only together" in fit.message
    for key in ("ward_bounded.ay", "ward_bounded.rs"):
        assert bool(fit.parameters[key].isnan().all() and fit.intervals[key].isnan().all())
    assert fit.singular_values[-1] < 1e-6 < 0.1 < fit.singular_values[-2]
    assert "\nsingular values of the scaled Jacobian: 1.7" in fit.report()
    values = fit.values["ward_bounded.rs"].tolist()
    (weights,) = fit.combinations
    relative = [weights[f"ward_bounded.rs[{c}]"] / v for c, v in zip("rgb", values, strict=True)]
    assert relative == pytest.approx([weights["ward_bounded.ay"] / float(fit.values["ward_bounded.ay"])] * 3, rel=1e-4)
    assert sum(w * w for w in weights.values()) == pytest.approx(1)
    low, high = fit.intervals["ward_bounded.ax"].tolist()
    assert low <= 0.12 * (1 + 1e-9)
    assert high >= 0.12 * (1 - 1e-9)
    assert all(bool(value.isfinite().all()) for value in fit.material.values().values())


def test_what_is_determined_does_not_depend_on_what_is_not() -> None:
    """With ay fixed nothing is free, and ax and kd have the same errors as before, wherever it is fixed."""
    samples = half_angle_grid(TRUE, 0.02)
    free = bc.fit(samples, "lambert + ward_bounded(anisotropic)")
    for ay in (0.05, 0.12):
        fixed = bc.fit(samples, "lambert + ward_bounded(anisotropic)", fixed={"ward_bounded.ay": ay})
        assert fixed.status == "converged"
        for key in ("lambert.kd", "ward_bounded.ax"):
            torch.testing.assert_close(fixed.intervals[key], free.intervals[key], rtol=1e-3, atol=0)


@pytest.mark.full
@pytest.mark.parametrize("name", ["alum-bronze", "blue-fabric", "gold-paint", "black-phenolic"])
def test_so_it_is_on_reconstructions_of_merl(measured: pathlib.Path, tmp_path: pathlib.Path, name: str) -> None:
    (tmp_path / "reconstruction.binary").write_bytes(merl_reconstruction(measured, name))
    fit = bc.fit(bc.read(tmp_path / "reconstruction.binary"), "lambert + ward_bounded(anisotropic)")
    assert "ward_bounded.ay with ward_bounded.rs" in fit.undetermined
    assert not bool(fit.intervals["ward_bounded.ax"].isnan().any())


@pytest.mark.parametrize("name", FRESNEL)
def test_without_grazing_angles_ks_and_f0_are_determined_only_together(name: str) -> None:
    """Schlick's factor hardly rises: kurt.f0 even ends at 1 with a tenth of ks, pressed there by noise alone."""
    fit = bc.fit(steep_less(f"lambert(kd=0.2) + {FRESNEL[name]}", 30), f"lambert + {FRESNEL[name].split('(')[0]}")
    assert fit.status == "undetermined"
    assert fit.undetermined == (f"{name}.f0 with {name}.ks",)
    assert not set(fit.covariance_keys) & {f"{name}.f0", f"{name}.ks"}
    assert any("degrees apart, where Schlick's factor" in sentence for sentence in fit.warnings)
    kd = fit.intervals["lambert.kd"].tolist()
    assert kd[0] < 0.2 < kd[1]
    assert kd[1] - kd[0] < 0.01


@pytest.mark.parametrize("name", FRESNEL)
def test_with_grazing_angles_they_are_determined(name: str) -> None:
    fit = bc.fit(steep_less(f"lambert(kd=0.2) + {FRESNEL[name]}", 75), f"lambert + {FRESNEL[name].split('(')[0]}")
    assert (fit.status, fit.undetermined, fit.combinations) == ("converged", (), ())
    low, high = fit.intervals[f"{name}.ks"].tolist()
    assert low < 0.4 < high
    assert high - low < 0.15


def test_where_they_just_become_determined_the_intervals_hold() -> None:
    """At 46 degrees a few data sets do not tell; of those that do, the intervals hold the truth."""
    model = "lambert + kurt_plausible(isotropic)"
    fits = [bc.fit(steep_less(f"lambert(kd=0.2) + {FRESNEL['kurt_plausible']}", 46, seed), model) for seed in range(16)]
    told = [fit.intervals["kurt_plausible.ks"].tolist() for fit in fits if not fit.undetermined]
    assert 8 <= len(told) < 16
    assert sum(low <= 0.4 <= high for low, high in told) >= 0.8 * len(told)


def test_channels_are_named_where_others_determine_theirs() -> None:
    samples = measured_from(TRUE, noise=0.01)
    noise = torch.randn(samples.values.shape, generator=torch.Generator().manual_seed(8), dtype=torch.float64)
    noisier = samples.values + noise * torch.tensor([0.0, 0.0, 10.0]) / samples.wi[:, 2:]
    fit = bc.fit(bc.Samples(samples.wi, samples.wo, noisier), "lambert + ward_bounded(isotropic)")
    assert "lambert.kd[b]" in fit.undetermined
    assert fit.parameters["lambert.kd"].isnan().tolist() == [False, False, True]
    assert fit.to_dict()["parameters"]["lambert.kd"][2] is None


def test_channels_that_share_a_combination_are_named_once() -> None:
    """Three channels with their own f0: three directions, one sentence."""
    text = "lambert(kd=[0.1, 0.2, 0.3]) + kurt_plausible(isotropic, ks=[0.4, 0.5, 0.6], f0=0.1, m=0.15)"
    fit = bc.fit(steep_less(text, 30), "lambert + kurt_plausible", per_channel=["kurt_plausible.f0"])
    assert fit.undetermined == ("kurt_plausible.f0 with kurt_plausible.ks",)
    assert [sorted(one) for one in fit.combinations] == [
        [f"kurt_plausible.f0[{c}]", f"kurt_plausible.ks[{c}]"] for c in "rgb"
    ]


def test_a_batch_names_what_each_material_leaves_free() -> None:
    with_lobe = measured_from(TRUE, noise=0.01)
    without = measured_from("lambert(kd=[0.1, 0.2, 0.3])", noise=0.01)
    several = [with_lobe, without, with_lobe]
    for samples, fit in zip(several, fit_batch(several, "lambert + ward_bounded"), strict=True):
        alone = bc.fit(samples, "lambert + ward_bounded")
        assert (fit.undetermined, fit.status, fit.warnings) == (alone.undetermined, alone.status, alone.warnings)
        assert fit.covariance_keys == alone.covariance_keys
        torch.testing.assert_close(fit.covariance, alone.covariance, rtol=1e-4, atol=1e-12)


def test_covariances_are_those_of_the_standard_errors() -> None:
    fit = bc.fit(measured_from(TRUE, noise=0.02), "lambert + ward_bounded(isotropic)")
    assert fit.covariance_keys == (
        *(f"lambert.kd[{c}]" for c in "rgb"),
        *(f"ward_bounded.rs[{c}]" for c in "rgb"),
        "ward_bounded.a",
    )
    errors = torch.cat([fit.standard_errors[key].reshape(-1) for key in fit.parameters])
    torch.testing.assert_close(fit.covariance.diagonal().sqrt(), errors, rtol=1e-9, atol=0)
    assert torch.equal(fit.correlations.diagonal(), torch.ones(7, dtype=torch.float64))
    torch.testing.assert_close(fit.correlations * errors * errors.unsqueeze(-1), fit.covariance, rtol=1e-9, atol=1e-18)


def test_covariances_are_those_of_many_fits() -> None:
    """The correlation of width and reflectance that a fit claims is that of fits to 300 draws of the noise."""
    text, (wi, wo) = "lambert(kd=0.2) + ward_bounded(isotropic, rs=0.1, a=0.15)", directions(100, 3)
    with torch.no_grad():
        f = bc.material(text).f(wi, wo)
    generator = torch.Generator().manual_seed(5)
    draws = [f + 0.02 * torch.randn(f.shape, generator=generator, dtype=f.dtype) / wi[:, 2:] for _ in range(300)]
    sigma = 0.02 / wi[:, 2:]
    fits = fit_batch([bc.Samples(wi, wo, y, sigma=sigma) for y in draws], "lambert + ward_bounded(isotropic)")
    found = torch.stack([torch.stack([fit.parameters[key] for key in fits[0].covariance_keys]) for fit in fits])
    claimed = torch.stack([fit.correlations for fit in fits]).mean(0)
    torch.testing.assert_close(torch.corrcoef(found.T), claimed, rtol=0, atol=0.17)  # 3 / sqrt(300)
    scale = found.std(0) / torch.stack([fit.covariance.diagonal().sqrt() for fit in fits]).mean(0)
    assert scale.tolist() == pytest.approx([1, 1, 1], abs=0.13)


def test_strong_correlations_are_reported() -> None:
    fit = bc.fit(steep_less(f"lambert(kd=0.2) + {FRESNEL['ggx']}", 55), "lambert + ggx(isotropic, schlick)")
    (line,) = [line for line in fit.report().splitlines() if line.startswith("strongly correlated: ")]
    assert "ggx.ks and ggx.f0 (-0.9" in line


def test_json_holds_covariances_of_up_to_32_values() -> None:
    few = bc.fit(measured_from(TRUE, noise=0.02), "lambert + ward_bounded(isotropic)").to_dict()
    assert len(few["covariance"]) == len(few["correlations"]) == len(few["covariance_keys"]) == 7
    wi, wo = directions(60, 0)
    values = 0.1 + 0.01 * torch.rand(60, 33, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    many = bc.fit(bc.Samples(wi, wo, values), "lambert")
    assert many.covariance.shape == (33, 33)
    result = json.loads(json.dumps(many.to_dict(), allow_nan=False))
    assert result["covariance"] is result["correlations"] is None
    assert len(result["covariance_keys"]) == 33


def test_of_many_channels_the_number_that_takes_part_is_named() -> None:
    """Eight channels of which five have a lobe: the others' ks is 0 whatever f0 is."""
    text = f"lambert(kd=0.2) + kurt_plausible(isotropic, ks={[0.4] * 5 + [0.0] * 3}, f0=0.1, m=0.15)"
    fit = bc.fit(steep_less(text, 30), "lambert + kurt_plausible")
    assert fit.undetermined == ("kurt_plausible.f0 with kurt_plausible.ks in 5 channels",)
    assert fit.parameters["kurt_plausible.ks"].isnan().tolist() == [True] * 5 + [False] * 3
    assert len(fit.combinations[0]) == 6


def test_many_channels_do_not_make_a_direction_long() -> None:
    """In 31 channels, each ks known to 0.1 along one direction: no value crosses its range, so all are told."""
    text = f"lambert(kd=0.1) + ggx(isotropic, schlick, ks={[0.5] * 31}, f0=0.1, a=0.15)"
    fit = bc.fit(steep_less(text, 38), "lambert + ggx(isotropic, schlick)")
    lengths = fit.intervals["ggx.ks"].diff()
    assert fit.status == "converged"
    assert 0.1 < float(lengths.median()) < 0.9


def test_a_weak_direction_counts_with_the_range_that_is_searched_along_it() -> None:
    """Three values over ranges of 1 and a direction (1, 1, 0.2) of variance 100: the third is told, to 0.2 / 3.92."""
    weak = torch.tensor([1.0, 1.0, 0.2], dtype=torch.float64)
    turned = torch.linalg.qr(torch.stack([weak, weak.new_tensor([1, -1, 0]), weak.new_tensor([0, 0, 1])], dim=1))[0]
    matrix = turned @ torch.diag(weak.new_tensor([0.01, 1e6, 1e6])) @ turned.T
    ones, none = torch.ones(3, dtype=torch.float64), torch.zeros(3, dtype=torch.bool)
    found = unseen(matrix, matrix, ~none, none, ones, 0.5 * ones)
    torch.testing.assert_close(found.directions.abs(), weak.unsqueeze(0), rtol=1e-4, atol=0)
    assert found.taking_part.tolist() == [[True, True, False]]
    kept, over_range = found.kept(ones)
    covariance = Spectrum.of(matrix[None], ~none[None]).covariance(matrix[None], kept)[0] + over_range
    assert float(covariance[2, 2].sqrt()) == pytest.approx(0.2 / 3.919928, rel=1e-3)
    narrow = unseen(100 * matrix, matrix / 1e4, ~none, none, ones, 0.5 * ones)
    assert narrow.directions.shape == (0, 3)


def test_directions_are_made_of_few_values() -> None:
    apart = torch.tensor([[1.0, 0.5, 0, 0, 0], [0, 0, 1.0, -0.3, 0]], dtype=torch.float64)
    mixed = torch.tensor([[0.6, 0.8], [-0.8, 0.6]], dtype=torch.float64) @ apart
    found = _sparse(mixed)
    torch.testing.assert_close(found[found[:, 0].abs().argsort(descending=True)], apart, rtol=0, atol=1e-15)
