"""What directions can show at all, in facts and in sentences, and which of those concern a model."""

import math

import pytest
import torch
from fit_cases import directions, measured_from

import brdfcore as bc
from brdfcore.formats import merl
from brdfcore.geometry import from_angles

LOBE = "lambert + ward_bounded(isotropic)"


def in_plane(theta_i: list[float], theta_o: list[float]) -> bc.Samples:
    """Samples of a glossy surface, one for each pair of angles [degrees]; theta_o is positive on the mirror side."""
    clean = bc.Samples.from_angles(theta_i, 0.0, theta_o, 180.0, [1.0] * len(theta_i), "degrees")
    f = bc.material("lambert(kd=0.2) + ward_bounded(isotropic, rs=0.1, a=0.3)").f(clean.wi, clean.wo).detach()
    return bc.Samples(clean.wi, clean.wo, f)


def test_facts_are_those_of_the_directions() -> None:
    support = bc.supports(in_plane([30, 30, 60, 60.2], [30, 10, 60, -60]))
    assert (support.samples, support.channels, support.incidences) == (4, 1, 2)
    assert not support.same_directions
    assert not support.azimuth_observed
    assert [math.degrees(angle) for angle in support.theta_h] == pytest.approx([0, 60.1], abs=1e-6)
    assert math.degrees(support.largest_theta_d) == pytest.approx(60, abs=1e-6)


def test_all_round_the_hemisphere_nothing_is_hidden() -> None:
    support = bc.supports(measured_from("lambert(kd=[0.1, 0.2])"))
    assert support.azimuth_observed
    assert support.channels == 2
    assert support.sentences == ()


def test_a_half_angle_table_hides_the_azimuth_alone() -> None:
    wi, wo = (torch.from_numpy(w[::97]) for w in merl.grid()[:2])
    above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    samples = bc.Samples(wi[above], wo[above], torch.ones(int(above.sum())), azimuth_observed=False)
    assert list(bc.supports(samples).limits) == ["anisotropy"]


SPREAD = [10.0, 30.0, 50.0, 70.0, 80.0]
HIDDEN = {
    "incidence": (in_plane([45.0] * 9, [-80, -60, -30, 0, 30, 45, 60, 75, 80]), "one angle of incidence, 45 degrees"),
    "width": (in_plane(SPREAD, [a - 40 for a in SPREAD]), "No half vector is nearer to the normal than 20 degrees"),
    "height": (in_plane(SPREAD, SPREAD), "All half vectors are 1.1e-06 degrees from the normal"),
    "fresnel": (in_plane([5, 15, 25, 30, 30], [5, 15, 20, 30, 10]), "at most 30 degrees apart, where Schlick's factor"),
}


@pytest.mark.parametrize("case", HIDDEN)
def test_what_is_hidden_is_said_where_it_concerns_the_model(case: str) -> None:
    samples, sentence = HIDDEN[case]
    sentence = sentence.split(" 1.1e-06")[0]  # a rounded 0
    model = "lambert + kurt(isotropic)"
    assert any(sentence in one for one in bc.supports(samples).sentences)
    assert any(sentence in one for one in bc.fit(samples, model).warnings)
    assert not any(sentence in one for one in bc.fit(samples, "lambert").warnings)


def test_what_is_fixed_concerns_nobody() -> None:
    samples, sentence = HIDDEN["fresnel"]
    assert not any(sentence in one for one in bc.fit(samples, "lambert + kurt", fixed={"kurt.f0": 0.04}).warnings)
    mirror, sentence = HIDDEN["width"]
    assert not any(sentence in one for one in bc.fit(mirror, LOBE, fixed={"ward_bounded.a": 0.1}).warnings)
    everything = {"lambert.kd": 0.2, "ward_bounded.rs": 0.1, "ward_bounded.a": 0.1}
    assert bc.fit(samples, LOBE, fixed=everything).warnings == ()


def test_an_anisotropic_lobe_needs_a_turned_sample() -> None:
    wi, wo = directions(60, 0)
    values = torch.rand(60, 1, generator=torch.Generator().manual_seed(2), dtype=torch.float64)
    still = bc.Samples(wi, wo, values, azimuth_observed=False)
    said = "The sample's azimuth was not observed"
    assert any(said in one for one in bc.fit(still, "lambert + ward_bounded(anisotropic)").warnings)
    assert not any(said in one for one in bc.fit(still, "lambert + ward_bounded").warnings)
    assert bc.fit(bc.Samples(wi, wo, values), "lambert + ward_bounded(anisotropic)").warnings == ()


def test_a_batch_is_told_what_each_material_needs() -> None:
    theta = torch.linspace(0.1, 1.3, 40, dtype=torch.float64)
    wi, wo = from_angles(theta, 0 * theta), from_angles(theta.flip(0), 0 * theta + math.pi)
    bright = torch.rand(40, 1, generator=torch.Generator().manual_seed(2), dtype=torch.float64)
    several = [bc.Samples(wi, wo, bright), bc.Samples(wi, wo, 0 * bright)]
    lit, dark = (fit.warnings for fit in bc.fit_batch(several, LOBE))
    assert not any("No value is positive" in one for one in lit)
    assert any("No value is positive" in one for one in dark)
