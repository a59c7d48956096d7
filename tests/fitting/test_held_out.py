"""Errors at incidences that were left out."""

import json
import math
import statistics

import numpy as np
import pytest
import torch
from fit_cases import TRUE, directions, measured_from

import brdfcore as bc
from brdfcore.errors import ParameterError
from brdfcore.fitting.folds import blocks, dealt
from brdfcore.fitting.held_out import typical
from brdfcore.fitting.losses import Scales

MODEL = "lambert + ward_bounded(isotropic)"


def goniometer(
    incidences: list[float], outgoing: int = 25, turns: tuple[float, ...] = (0.0,), seed: int = 3
) -> bc.Samples:
    rows = [(t, p, o, p + 180) for t in incidences for p in turns for o in np.linspace(-70, 70, outgoing)]
    angles = np.array(rows).T
    empty = bc.Samples.from_angles(*angles, values=np.zeros(len(rows)), unit="degrees")
    with torch.no_grad():
        f = bc.material("lambert(kd=0.2) + ward_bounded(isotropic, rs=0.1, a=0.2)").f(empty.wi, empty.wo)
    noise = torch.randn(f.shape, generator=torch.Generator().manual_seed(seed), dtype=f.dtype)
    return bc.Samples(empty.wi, empty.wo, f * (1 + 0.02 * noise))


@pytest.mark.parametrize("loss", ["cosine", "log", "relative"])
def test_a_fold_is_the_fit_to_the_other_samples(loss: str) -> None:
    """The batch of weights finds what a fit of its own finds, and its error is that at the samples left out."""
    samples = goniometer([10.0, 20.0, 35.0, 50.0, 60.0, 70.0])
    found = bc.held_out(samples, MODEL, loss, folds=3, seed=2)
    fold = dealt(blocks(samples, 3), samples, 3, 2)
    for number in range(3):
        fit = bc.fit(samples.subset(fold != number), MODEL, loss=loss)
        rest = samples.subset(fold == number)
        difference = bc.LOSSES[loss].difference
        with torch.no_grad():
            f = fit.material.f(rest.wi, rest.wo)
        scales = Scales.of(samples.values, samples.wi[:, 2:])
        own = difference(f, rest.values, rest.wi[:, 2:], scales).square().mean().sqrt()
        # the relative loss's own scale is that of all samples here, of the others' in the fit by hand
        assert found.folds[number] == pytest.approx(float(own), rel=1e-2 if loss == "relative" else 1e-5)
    assert found.fitted < found.error
    assert found.fitted == pytest.approx(
        math.sqrt(bc.fit(samples, MODEL, loss=loss).errors[loss] / len(samples)), rel=1e-9
    )


def test_folds_are_whole_incidences_with_their_angles() -> None:
    incidences = [10.0, 20.0, 35.0, 50.0, 60.0, 70.0]
    found = bc.held_out(goniometer(incidences), MODEL, folds=3)
    assert sorted(round(math.degrees(one.theta), 6) for one in found.incidences) == incidences
    assert {one.samples for one in found.incidences} == {25}
    by_fold = [[one.theta for one in found.incidences if one.fold == fold] for fold in range(3)]
    assert [len(some) for some in by_fold] == [2, 2, 2]
    mean = math.sqrt(sum(one.error**2 * one.samples for one in found.incidences) / 150)
    assert mean == pytest.approx(found.error, rel=1e-12)
    assert json.loads(json.dumps(found.to_dict()))["incidences"][0].keys() == {"theta", "fold", "samples", "error"}


def test_turning_a_sample_makes_incidences_only_where_it_can_show() -> None:
    turned = goniometer([20.0, 50.0], turns=(0.0, 45.0, 90.0))
    assert int(blocks(turned, 5).max()) == 5
    still = goniometer([20.0, 50.0, 70.0], turns=(0.0, 180.0))
    assert int(blocks(still, 3).max()) == 2


def test_without_enough_incidences_blocks_are_neighbours() -> None:
    one = goniometer([30.0], outgoing=60)
    block = blocks(one, 5)
    assert int(block.max()) == 19
    assert bool((block.diff().abs() <= 1).all()), "in-plane neighbours share a block or stand in the next"
    assert bc.held_out(one, MODEL).error > 0


def test_scattered_incidences_become_bands_of_theta() -> None:
    wi, wo = directions(4000, 1)
    block = blocks(bc.Samples(wi, wo, torch.ones(4000), azimuth_observed=False), 5)
    assert int(block.max()) == 19
    theta = torch.acos(wi[:, 2])
    low, high = (torch.stack([f(theta[block == k]) for k in range(20)]) for f in (torch.min, torch.max))
    assert bool((high[:-1] < low[1:]).all())
    assert int(blocks(bc.Samples(wi, wo, torch.ones(4000)), 5).max()) == 79


def test_a_model_of_too_many_values_is_seen_through() -> None:
    """Of five data sets, most of its fits do better at their own samples, and worse at those left out."""
    own, others = [], []
    for seed in range(1, 6):
        samples = measured_from("lambert(kd=0.2) + ward_bounded(isotropic, rs=0.1, a=0.2)", 30, noise=0.02, seed=seed)
        plain, rich = bc.held_out(samples, MODEL), bc.held_out(samples, "lambert + kurt(isotropic)")
        own.append(rich.fitted / plain.fitted)
        others.append(rich.error / plain.error)
    assert statistics.median(own) < 0.98
    assert statistics.median(others) > 1.02
    assert bc.held_out(samples, "lambert").error > 3 * plain.error


def test_sigma_weight_and_robust_forms_are_those_of_the_fit() -> None:
    known = measured_from(TRUE, noise=0.01, sigma=True)
    assert bc.held_out(known, MODEL).error == pytest.approx(0.01, rel=0.1), "of c f, as the loss's residual is"
    assert bc.held_out(known, MODEL, robust="cauchy").error < bc.held_out(known, MODEL).error
    fixed = bc.held_out(
        known, MODEL, fixed={"lambert.kd": [0.1, 0.2, 0.3], "ward_bounded.rs": 0.1, "ward_bounded.a": 0.1}
    )
    assert fixed.error == fixed.fitted


def test_refusals() -> None:
    samples = goniometer([30.0], outgoing=5)
    for folds, advice in ((1, "from 2 on, got 1. Use 5."), (True, "got True"), (6, "got 6 for 5. Lower it.")):
        with pytest.raises(ParameterError, match=r"^Expected folds to be ") as caught:
            bc.held_out(samples, "lambert", folds=folds)
        assert advice in str(caught.value)
        assert caught.value.field == "folds"
    same = bc.Samples(samples.wi[:1].expand(5, 3), samples.wo[:1].expand(5, 3), torch.ones(5))
    with pytest.raises(bc.errors.SamplesError, match=r"^Expected samples to hold several directions") as caught:
        bc.held_out(same, "lambert")
    assert caught.value.field == "samples"


def test_a_block_without_weight_has_no_error() -> None:
    incidences = [10.0, 20.0, 35.0, 50.0, 60.0, 70.0]
    samples = goniometer(incidences)
    theta = torch.rad2deg(torch.acos(samples.wi[:, 2]))
    weight = (theta < 65).double()
    found = bc.held_out(bc.Samples(samples.wi, samples.wo, samples.values, weight=weight), MODEL, folds=3)
    without = [one for one in found.incidences if round(math.degrees(one.theta)) == 70]
    assert [math.isnan(one.error) for one in without] == [True]
    assert all(one.error > 0 for one in found.incidences if one not in without)
    data = found.to_dict()
    assert [one["error"] for one in data["incidences"]].count(None) == 1
    assert data["error"] == found.error
    json.dumps(data, allow_nan=False)


def test_folds_conserve_energy_where_that_is_asked_for() -> None:
    """Each fold by hand, of data whose free fit does not; and what is fitted is the fit that does."""
    samples = goniometer([10.0, 20.0, 35.0, 50.0, 60.0, 70.0])
    samples = bc.Samples(samples.wi, samples.wo, 4.5 * samples.values)
    seen: list[bc.Progress] = []
    found = bc.held_out(samples, MODEL, folds=2, seed=2, conserve_energy=True, progress=seen.append)
    whole = bc.fit(samples, MODEL, conserve_energy=True)
    assert whole.conservation is not None
    assert whole.conservation.free_max_albedo > 1
    assert found.fitted == pytest.approx(math.sqrt(whole.objective / len(samples)), rel=1e-9)
    fold = dealt(blocks(samples, 2), samples, 2, 2)
    for number in range(2):
        fit, rest = bc.fit(samples.subset(fold != number), MODEL, conserve_energy=True), samples.subset(fold == number)
        with torch.no_grad():
            own = (rest.wi[:, 2:] * (fit.material.f(rest.wi, rest.wo) - rest.values)).square().mean().sqrt()
        assert found.folds[number] == pytest.approx(float(own), rel=1e-6)
    assert found.error != pytest.approx(bc.held_out(samples, MODEL, folds=2, seed=2).error, rel=1e-3)
    fractions = [p.fraction for p in seen]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1


def test_the_typical_error_is_a_geometric_mean_that_no_block_decides() -> None:
    """Blocks of root mean squares 1 and 4, alike in samples, make 2; a block counts as its samples do."""
    block = torch.tensor([0, 0, 1, 1])
    squares, weights = torch.tensor([2.0, 0.0, 10.0, 22.0]).double(), torch.ones(4, dtype=torch.float64)
    assert typical(squares, weights, block, 0.0) == pytest.approx(2)
    assert typical(squares, 4 * weights, block, 0.0) == pytest.approx(1)
    more = torch.cat([squares, torch.tensor([3e6, 0.0, 0.0]).double()])
    found = typical(more, torch.ones(7, dtype=torch.float64), torch.tensor([0, 0, 1, 1, 2, 2, 2]), 0.0)
    assert found == pytest.approx(4 ** (2 / 7) * 1000 ** (3 / 7))
    half = torch.tensor([1, 1, 1, 0, 0, 0]).double()  # a block without weight, and a sample without
    assert typical(torch.cat([squares[:3], half[3:]]), half, torch.tensor([0, 0, 1, 1, 2, 2]), 0.0) == pytest.approx(
        10 ** (1 / 6)
    )
    assert typical(torch.zeros(4).double(), weights, block, 0.0) == 0
    assert typical(0 * squares + torch.tensor([2.0, 0, 0, 0]), weights, block, 0.25) == pytest.approx(0.5)
