"""Proposals of where to measure next do what they predict."""

import json
import math

import pytest
import torch
from fit_cases import measured_from
from generated_materials import geometry, of

import brdfcore as bc
from brdfcore.errors import ParameterError
from brdfcore.fitting.next_directions import reachable

KURT = "lambert(kd=0.2) + kurt(isotropic, ks=0.5, f0=0.3, m=0.2, alpha=0.1)"
FIXED = "lambert + kurt(isotropic)"
WARD = "lambert + ward_bounded(isotropic)"


def within(where: bc.Samples, degrees: float) -> bc.Samples:
    least = math.cos(math.radians(degrees))
    return where.subset((where.wi[:, 2] > least) & (where.wo[:, 2] > least))


def measured(text: str, where: bc.Samples, seed: int, *, sigma: bool = False, share: float = 0.02) -> bc.Samples:
    f = of(text, where)
    y = f * (1 + share * torch.randn(f.shape, generator=torch.Generator().manual_seed(seed), dtype=f.dtype))
    return bc.Samples(where.wi, where.wo, y, sigma=share * f if sigma else None)


def joined(a: bc.Samples, b: bc.NextDirections | bc.Samples) -> bc.Samples:
    count = len(a) + len(b.wi)
    return bc.Samples(torch.cat([a.wi, b.wi]), torch.cat([a.wo, b.wo]), torch.ones(count, a.values.shape[1]))


def spreads(text: str, model: str, where: bc.Samples, *, sigma: bool, count: int) -> dict[str, torch.Tensor]:
    """Standard deviations of the stored values over refits to new noise, of logarithms where so stored."""
    fits = bc.fit_batch([measured(text, where, 1000 + i, sigma=sigma) for i in range(count)], model)
    found = {}
    for key, parameter in fits[0].form.parameters.items():
        found[key] = parameter.to_raw(torch.stack([fit.values[key] for fit in fits])).std(0)
    return found


@pytest.mark.parametrize("sigma", [True, False])
def test_the_predicted_shrinkage_is_that_of_refits(sigma: bool) -> None:
    """Over 100 refits to new noise before and after; their ratio has a standard error of 10 %, allowed are three."""
    model = "lambert + ward_bounded(isotropic)"
    text = "lambert(kd=0.2) + ward_bounded(isotropic, rs=0.1, a=0.2)"
    before = within(geometry(turned=False), 60)
    next_ = bc.next_directions(bc.fit(measured(text, before, 0, sigma=sigma), model), 12)
    old = spreads(text, model, before, sigma=sigma, count=100)
    new = spreads(text, model, joined(before, next_), sigma=sigma, count=100)
    for key, predicted in next_.shrinkage.items():
        assert float(new[key] / old[key]) == pytest.approx(float(predicted), rel=0.3), key
    assert min(float(s) for s in next_.shrinkage.values()) < 0.8


@pytest.mark.parametrize("loss", ["cosine", "log"])
def test_no_value_becomes_less_sure(loss: str) -> None:
    """Noise that grows with the value, under losses that do not weigh so: near grazing it would blur what is known."""
    fit = bc.fit(measured(KURT, within(geometry(turned=False), 75), 0, share=0.1), FIXED, loss=loss)
    next_ = bc.next_directions(fit, 6)
    assert max(float(s.max()) for s in next_.shrinkage.values()) <= 1 + 1e-9
    assert next_.information > 0.1


def information(fit: bc.Fit, wi: torch.Tensor, wo: torch.Tensor, share: float) -> torch.Tensor:
    """The matrix sum of (df/dx)^2 / sigma^2 by differences, for a sigma that is a share of f."""
    columns = []
    f = bc.Material(fit.form, fit.values).f(wi, wo).detach()
    for key, value in fit.values.items():
        step = 1e-6 * float(value)
        up, down = (bc.Material(fit.form, {**fit.values, key: value + s}).f(wi, wo).detach() for s in (step, -step))
        columns.append((up - down) / (2 * step) / (share * f))
    j = torch.cat(columns, -1)
    return j.T @ j


def test_proposals_beat_random_directions() -> None:
    """The determinant of the information is e times that of the best of 50 random sets, and what is claimed."""
    where = within(geometry(turned=False), 60)
    fit = bc.fit(measured(KURT, where, 0, sigma=True), FIXED)
    proposed = bc.next_directions(fit, 5)
    before = information(fit, fit.samples.wi, fit.samples.wo, 0.02)

    def gained(wi: torch.Tensor, wo: torch.Tensor) -> float:
        after = before + information(fit, wi, wo, 0.02)
        return float(torch.logdet(after) - torch.logdet(before))

    wi, wo = reachable(fit.samples, math.radians(85))
    generator = torch.Generator().manual_seed(0)
    draws = [torch.randint(len(wi), (5,), generator=generator) for _ in range(50)]
    best = gained(proposed.wi, proposed.wo)
    assert best == pytest.approx(proposed.information, rel=0.02)
    assert best > 1 + max(gained(wi[draw], wo[draw]) for draw in draws)


def test_without_grazing_angles_it_proposes_grazing_ones() -> None:
    """ks and f0 come apart at grazing angles alone."""
    where = within(geometry(turned=False), 35)
    fit = bc.fit(
        measured("lambert(kd=0.1) + kurt_plausible(isotropic, ks=0.5, f0=0.3, m=0.2)", where, 2),
        "lambert + kurt_plausible(isotropic)",
    )
    found = bc.next_directions(fit, 6)
    steep = torch.rad2deg(torch.maximum(found.angles["theta_i"], found.angles["theta_o"]))
    assert int((steep >= 75).sum()) >= 4
    assert float(steep.max()) <= 85 + 1e-9
    least = bc.next_directions(fit, 6, max_theta=math.radians(50))
    assert float(torch.rad2deg(torch.stack(list(least.angles.values())[::2])).max()) <= 50 + 1e-9
    assert least.information < found.information


def test_what_the_data_leave_free_is_determined_first() -> None:
    """Without samples near the mirror direction the lobe's width is free."""
    angles = torch.arange(0, 80, 5.0)
    where = bc.Samples.from_angles(60.0, 0.0, angles, 0.0, torch.ones(16), unit="degrees")
    text = "lambert(kd=0.2) + ward_bounded(isotropic, rs=0.1, a=0.05)"
    fit = bc.fit(measured(text, where, 0), "lambert + ward_bounded(isotropic, a=0.1)")
    found = bc.next_directions(fit, 3)
    assert float(found.shrinkage["ward_bounded.rs"]) < 0.3
    h = found.wi + found.wo
    assert float(torch.rad2deg(torch.acos(h[:, 2] / h.norm(dim=1))).max()) < 25


def test_colours_and_turned_samples() -> None:
    text = "lambert(kd=[0.1, 0.2, 0.3]) + ggx(constant, ks=[0.2, 0.2, 0.3], ax=0.1, ay=0.3)"
    where = within(geometry(turned=True), 50)
    fit = bc.fit(measured(text, where, 0), "lambert + ggx(anisotropic, constant)")
    found = bc.next_directions(fit, 3)
    assert found.shrinkage["lambert.kd"].shape == (3,)
    assert found.wi.shape == (3, 3)
    assert bool((torch.cat(list(map(torch.atleast_1d, found.shrinkage.values()))) < 1).all())
    result = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert list(result["directions"][0]) == ["theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg"]
    assert len({tuple(row.values()) for row in result["directions"]}) == 3


def test_it_stays_in_the_plane_that_was_measured() -> None:
    plane = bc.Samples.from_angles(torch.tensor([20.0, 50.0]), 30.0, 40.0, 210.0, torch.ones(2), unit="degrees")
    wi, wo = reachable(plane, math.radians(80))
    assert float(torch.linalg.cross(wi, wo)[:, 2].abs().max()) < 1e-12
    pairs = (torch.cat([wi, wo], -1) * 1e5).round() + 0.0
    assert len(torch.unique(pairs, dim=0)) == len(pairs)
    assert torch.atan2(wi[:, 1], wi[:, 0])[wi[:, 2] < 0.99].rad2deg().round().unique().tolist() == [30.0]
    aside, _ = reachable(geometry(turned=False), math.radians(80))
    turned, _ = reachable(geometry(turned=True), math.radians(80))
    assert len(wi) < len(aside) < len(turned)


def test_refusals() -> None:
    samples = measured(KURT, within(geometry(turned=False), 30), 0)
    fit = bc.fit(samples, "lambert")
    for count in (0, 1.5, True):
        with pytest.raises(ParameterError, match=r"^Expected count to be a whole number from 1 on") as caught:
            bc.next_directions(fit, count)
        assert caught.value.field == "count"
    with pytest.raises(ParameterError, match=r"^Expected max_theta to be an angle"):
        bc.next_directions(fit, 3, max_theta=85)
    with pytest.raises(ParameterError, match=r"^Expected fit to have a free value") as caught:
        bc.next_directions(bc.fit(samples, "lambert", fixed={"lambert.kd": 0.2}), 3)
    assert caught.value.field == "fit"


def test_a_users_box_is_what_is_known_beforehand() -> None:
    """A width that the samples leave free: what more of them tell is little beside a box that is narrow already."""
    angles = torch.arange(0, 80, 5.0)
    where = bc.Samples.from_angles(60.0, 0.0, angles, 0.0, torch.ones(16), unit="degrees")
    samples = measured("lambert(kd=0.2) + ward_bounded(isotropic, rs=0.1, a=0.05)", where, 0)
    shares = []
    for bounds in ({}, {"ward_bounded.a": (0.0499, 0.0501)}):
        fit = bc.fit(samples, "lambert + ward_bounded(isotropic, a=0.05)", bounds=bounds)
        shares.append(float(bc.next_directions(fit, 3).shrinkage["ward_bounded.a"]))
    assert shares[0] < 0.8
    assert shares[1] > 0.99


def test_outliers_that_a_robust_form_sees_do_not_decide() -> None:
    """What is gained is that of a fit to the good samples, not what the bad ones make of it."""
    good, model = measured_from("lambert(kd=0.2) + ward_bounded(isotropic, rs=0.1, a=0.15)", noise=0.003), WARD
    values = good.values.clone()
    values[::10] *= 5
    bad = bc.Samples(good.wi, good.wo, values)
    clean = torch.ones(len(good), dtype=torch.bool)
    clean[::10] = False
    robust = bc.fit(bad, model, robust="cauchy", robust_scale=0.007)
    assert robust.robust_scale == 0.007
    fits = bc.fit(good.subset(clean), model), robust, bc.fit(bad, model)
    of_good, of_robust, of_plain = (bc.next_directions(fit, 8).information for fit in fits)
    assert of_robust == pytest.approx(of_good, rel=0.2)
    assert of_plain < 0.5 * of_good


@pytest.mark.parametrize("count", [1, 2])
def test_a_fit_that_leaves_no_residuals_has_next_directions(count: int) -> None:
    """Its residuals are rounding, which tells nothing of the noise."""
    few = measured_from("lambert(kd=0.2) + ward_bounded(isotropic, rs=0.1, a=0.15)", noise=0.003, count=10)
    for first in range(8):
        fit = bc.fit(few.subset(torch.arange(first, first + count)), "lambert + ward_bounded(isotropic)")
        proposed = json.loads(json.dumps(bc.next_directions(fit, 1).to_dict(), allow_nan=False))
        assert all(0 < share <= 1 for share in proposed["shrinkage"].values())
