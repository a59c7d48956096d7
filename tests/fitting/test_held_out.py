"""Errors at incidences that a fit did not see, beside those that it did."""

import pytest
import torch
from fit_cases import directions

import brdfcore as bc
from brdfcore.demo import DATA, MODEL
from brdfcore.errors import SamplesError
from brdfcore.fitting.incidences import incidences


def test_the_right_model_predicts_and_a_wrong_one_does_not() -> None:
    """Ward's bounded lobe made the data; Blinn's does not rise, and what fits the rest fails at 25 degrees."""
    right = bc.held_out(bc.fit(bc.read(DATA), MODEL))
    assert [(one.low_deg, one.high_deg, one.samples) for one in right] == [(t, t, 37) for t in range(25, 76, 10)]
    assert all(one.unseen < 1.15 * one.seen for one in right)
    wrong = bc.held_out(bc.fit(bc.read(DATA), "lambert + blinn_phong"))
    assert wrong[0].unseen > 1.5 * wrong[0].seen > 3 * right[0].seen


def test_the_refit_is_a_fit_of_the_others_with_what_was_asked() -> None:
    """Fixed, gray and bounded values stay so."""
    samples = bc.read(DATA)
    asked = {"fixed": {"lambert.kd": 0.12}, "bounds": {"ward_bounded.a": (0.01, 0.02)}}
    (first, *_) = bc.held_out(bc.fit(samples, "lambert + ward_bounded", **asked))
    chosen = incidences(samples)[0].chosen
    other = bc.fit(samples.subset(~chosen), "lambert + ward_bounded", **asked)
    here = samples.subset(chosen)
    left = here.wi[:, 2:] * (other.material.f(here.wi, here.wo).detach() - here.values)
    assert first.unseen == pytest.approx(float(left.square().mean().sqrt()), rel=1e-9)


def test_incidences_hold_every_sample_once() -> None:
    wi, wo = directions(500, 0)
    groups = incidences(bc.Samples(wi, wo, torch.ones(500)))
    assert len(groups) == 6
    assert bool((torch.stack([group.chosen for group in groups]).sum(0) == 1).all())
    assert min(int(group.chosen.sum()) for group in groups) > 70


def test_one_incidence_cannot_be_held_out() -> None:
    samples = bc.Samples.from_angles(45.0, 0.0, [0.0, 30.0, 60.0], 180.0, [0.1, 0.2, 0.1], "degrees")
    with pytest.raises(SamplesError, match=r"^Expected samples at two or more angles of incidence, got 45 degrees"):
        bc.held_out(bc.fit(samples, "lambert"))
