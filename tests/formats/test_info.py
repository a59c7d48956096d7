"""`info`: facts against plain counting, reflectance against exact albedos, and the real files."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
import torch

import brdfcore as bc
from brdfcore.demo import DATA
from brdfcore.formats import Samples, read
from brdfcore.formats import info as module


def goniometer(incidences: list[float], per_side: int = 19) -> tuple[torch.Tensor, torch.Tensor]:
    """wi and wo of a Cartesian grid of viewing directions around each incidence, as instruments scan it."""
    axis = np.linspace(-1, 1, per_side)
    x, y = (a.ravel() for a in np.meshgrid(axis, axis))
    inside = np.hypot(x, y) < 0.995
    x, y = x[inside], y[inside]
    wo = np.stack([x, y, np.sqrt(1 - x**2 - y**2)], -1)
    wi = np.concatenate([np.tile([math.sin(t), 0, math.cos(t)], (len(wo), 1)) for t in np.radians(incidences)])
    return torch.from_numpy(wi), torch.from_numpy(np.tile(wo, (len(incidences), 1)))


def evaluated(text: str, incidences: list[float]) -> Samples:
    wi, wo = goniometer(incidences)
    with torch.no_grad():
        return Samples(wi, wo, bc.material(text).f(wi, wo))


@pytest.mark.parametrize(
    "text",
    [
        "lambert(kd=0.9)",
        "lambert(kd=0.3) + ward_bounded(rs=0.3, a=0.3)",
        "lambert(kd=0.1) + ward_bounded(rs=0.3, a=0.15)",
        "ggx(constant, ks=1, a=0.5)",
        "oren_nayar(kd=0.6, sigma=0.4)",
    ],
)
def test_reflectance_holds_what_it_claims(text: str) -> None:
    incidences = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0]
    found = bc.info(evaluated(text, incidences)).reflectance
    assert [row.theta_i_deg for row in found] == incidences
    exact = bc.albedo(bc.material(text), torch.tensor(incidences, dtype=torch.float64).deg2rad()).values.detach()
    for row, albedo in zip(found, exact[:, 0].tolist(), strict=True):
        factor = 2.0 if row.theta_i_deg > 60 else 1.0
        assert abs(row.values[0] - albedo) <= factor * row.error[0], row
        assert row.error[0] < 0.4 * albedo, "and it cannot hold by being vague"


def test_lambert_is_exact_and_its_error_is_the_rim() -> None:
    row = bc.info(evaluated("lambert(kd=0.9)", [30.0])).reflectance[0]
    assert row.values[0] == pytest.approx(0.9, rel=1e-12)
    assert row.error[0] < 0.02


def test_a_lobe_narrower_than_the_grid_is_not_integrated() -> None:
    info = bc.info(evaluated("ward_bounded(rs=0.5, a=0.01)", [45.0]))
    assert info.reflectance == ()
    assert "reflectance           unknown: too few directions" in info.text()


def test_directions_of_the_half_hemisphere_serve_where_the_azimuth_was_not_observed() -> None:
    wi, wo = goniometer([40.0])
    half = wo[:, 1] >= 0
    samples = Samples(wi[half], wo[half], torch.full((int(half.sum()),), 0.2))
    assert bc.info(samples).reflectance[0].values[0] == pytest.approx(0.2 * math.pi)
    turned = Samples(wi[half], wo[half], torch.full((int(half.sum()),), 0.2), azimuth_observed=True)
    assert bc.info(turned).reflectance == ()


def test_reciprocity_counts_pairs_once() -> None:
    samples = Samples.from_angles(
        [10, 50, 30, 20, 40], [0, 0, 0, 0, 0], [50, 10, 30, 40, 20], [90, -90, 10, 20, 21], [1, 3, 9, 2, 2], "degrees"
    )
    found = bc.info(samples).reciprocity
    assert found is not None
    assert found.pairs == 1, "the third is its own pair, and the last two differ by a degree"
    assert found.median == pytest.approx(1.0)
    turned = Samples(samples.wi, samples.wo, samples.values, azimuth_observed=True)
    assert bc.info(turned).reciprocity is None
    both = Samples.from_angles([10, 50], [20, 70], [50, 10], [70, 20], [[1, 2], [1, 2]], "degrees")
    assert both.azimuth_observed
    found = bc.info(both).reciprocity
    assert found is not None
    assert (found.pairs, found.largest) == (1, 0.0)


def test_pairs_are_not_looked_for_among_very_many_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    samples = Samples.from_angles([10, 50], 0, [50, 10], 0, [1, 2], "degrees")
    assert bc.info(samples).reciprocity is not None
    monkeypatch.setattr(module, "MOST_FOR_PAIRS", 1)
    assert "reciprocity           not looked for in so many samples" in bc.info(samples).text()


def test_facts_of_the_linoleum() -> None:
    samples = read(DATA)
    found = bc.info(samples)
    assert found.incidences_deg == tuple((float(t), 37) for t in range(25, 76, 10))
    assert found.theta_h_deg[1] == pytest.approx(80)
    assert found.near_mirror == 25
    assert found.brightest_from_mirror_deg == pytest.approx(0, abs=1e-6)
    assert not found.azimuth_declared
    assert found.ranges[0].largest == samples.values.max()
    assert found.reciprocity is not None
    for line in (
        "samples               222 in 1 channel",
        "with                  sigma",
        "light                 theta_i 25 to 75, phi_i 0 degrees",
        "incidences            theta_i (samples): 25 (37), 35 (37), 45 (37), 55 (37), 65 (37), 75 (37)",
        "sample's azimuth      not observed, by the azimuths of the light",
        "masked                nothing was left out",
    ):
        assert line in found.text().splitlines()


def test_masked_rows_and_many_channels_are_told(tmp_path: Path) -> None:
    names = ",".join(str(400 + 10 * k) for k in range(20))
    path = tmp_path / "x"
    path.write_text(
        f"# quantity: brdf\n# azimuth_observed: false\ntheta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,{names}\n"
        f"10,0,20,0{',1' * 20}\n10,0,20,0{',' * 20}\n10,0,90,0{',1' * 20}\n"
    )
    text = bc.info(read(path)).text()
    assert "masked                1 left out: a direction is at the horizon" in text
    assert "                      1 left out: a value's cell is empty" in text
    assert "                      and so on to 590" in text
    assert "sample's azimuth      not observed, as the file or its format says" in text


def test_a_reflectance_of_noise_has_no_negative_zero() -> None:
    text = bc.info(evaluated("lambert(kd=0.9)", [0.0])).text()
    assert "reflectance           theta_i 0: 0.9" in text
    samples = evaluated("lambert(kd=0.9)", [0.0])
    colours = torch.cat([samples.values, -1e-4 * samples.values], -1)
    text = bc.info(bc.Samples(samples.wi, samples.wo, colours, ("450", "650"))).text()
    assert "theta_i 0: 0.000 to 0.9" in text


def test_json_holds_everything() -> None:
    found = bc.info(evaluated("lambert(kd=0.9)", [0.0, 30.0]))
    facts = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert facts["samples"] == len(goniometer([0.0, 30.0])[0])
    assert facts["reflectance"][1]["theta_i_deg"] == 30.0
    assert facts["incidences_deg"][0][0] == 0.0
    assert {"masked", "azimuth_observed", "ranges", "reciprocity", "near_mirror"} <= set(facts)


def test_real_ptfe_reflects_nearly_everything(measured: Path) -> None:
    found = bc.info(read(measured / "nist_ptfe" / "PTFE.data.csv")).reflectance
    assert [row.theta_i_deg for row in found] == [0.0, 15.0, 30.0, 45.0, 60.0, 75.0]
    for row in found:
        assert min(row.values) > 0.95
        assert max(row.values) < 1.0
        assert max(row.error) < 0.03
