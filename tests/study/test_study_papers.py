"""The papers' figures again: what is read off is what is known, and the verdicts follow from it.

Names of the papers as in tests/models/test_known_answers.py.
"""

import math

import pytest
import torch

import brdfcore as bc
from brdfcore.geometry import from_angles
from brdfcore.study import STUDIES, _paper_figures, papers
from brdfcore.study.papers import Claim


@pytest.mark.parametrize("theta", [0.0, 60.0, 80.0, 88.0])
def test_the_share_of_samples_that_is_kept(theta: float) -> None:
    """Against counting: 65,536 samples, six standard errors."""
    wo = from_angles(torch.tensor(math.radians(theta), dtype=torch.float64), torch.zeros((), dtype=torch.float64))
    lost = float(bc.sampling.efficiency(bc.material("ward_bounded(rs=1, a=0.1)"), wo, seed=4).lost)
    kept = _paper_figures.kept_share(0.1, theta)
    assert kept == pytest.approx(1 - lost, abs=6 * math.sqrt(max(lost, 1e-5) / 65536))


def test_half_of_the_samples_are_kept_at_grazing() -> None:
    """G-M&D Fig. 6; .5005 at 89.99 degrees is checked."""
    assert _paper_figures.kept_share(0.1, 89.99) == pytest.approx(0.5005, abs=5e-5)


def test_lobes_are_the_models_in_the_plane_of_incidence() -> None:
    """G-M&D Fig. 4: f cos cos at the mirror direction is 1 / (4 pi a^2) at every angle."""
    for incidence in _paper_figures.INCIDENCES:
        at = torch.tensor([incidence], dtype=torch.float64)
        for a, peak in ((0.1, 7.958), (0.2, 1.989)):
            found = _paper_figures.lobe("ward_bounded", a, incidence, at, 180.0, True)
            assert float(found) == pytest.approx(peak, abs=5e-4)
            f = _paper_figures.lobe("ward_bounded", a, incidence, at, 180.0, False)
            assert float(f) == pytest.approx(peak / math.cos(math.radians(incidence)) ** 2, rel=1e-3)


def test_ashikhmin_and_shirleys_figures() -> None:
    found = {claim.read: claim for claim in papers._ashikhmin_shirley()}
    assert found["albedo at normal incidence"].found == pytest.approx(0.69571, abs=5e-6)
    assert found["lowest albedo"].found == pytest.approx(0.7368, abs=5e-5)
    assert found["at [degrees]"].found == pytest.approx(74.07, abs=0.02)
    assert all(claim.holds for claim in found.values())


def test_the_sentence_is_computed() -> None:
    good, bad = Claim("Fig. 1", "a", "b", 0.5, True), Claim("Fig. 2", "it is so", "largest", 1.5, False)
    assert papers._sentence([good, good]) == "All 2 statements hold."
    assert papers._sentence([good, bad]) == "1 of 2 statements hold; do not rely on Fig. 2, 'it is so' (largest: 1.5)."


@pytest.mark.full
def test_the_papers_study() -> None:
    """Every number that is known (models: known answers) stands in the table, and the verdicts are the known ones."""
    study = STUDIES["papers"](quick=True)
    found = {row[:3]: (row[3], row[4]) for row in study.rows}
    known = {
        ("Kurt Fig. 2", "eq. 9 is plausible", "largest albedo, m = 0.1"): (0.985, True),
        ("Kurt Fig. 2", "eq. 9 is plausible", "largest albedo, m = 3"): (1.443, False),
        ("Kurt Fig. 3", "chosen well, alpha > 0 is plausible too", "m = 0.35, alpha = 0.25 at 89.9 degrees"): (
            1.11,
            False,
        ),
        ("G-M&D Fig. 6", "sampling's albedo converges to 0.5", "at 89.99 degrees"): (0.5005, True),
        ("G-M&D Fig. 6", "Ward's albedo exceeds 1", "from, in degrees below 90"): (0.0069, True),
        ("G-M&D Fig. 6", "Ward-Dür's albedo exceeds 1", "from, in degrees below 90"): (4.4, True),
    }
    for key, (number, holds) in known.items():
        assert found[key][0] == pytest.approx(number, rel=0.012), key
        assert found[key][1] is holds, key
    failing = {(row[0], row[1]) for row in study.rows if not row[4]}
    assert failing == {
        ("Kurt Fig. 2", "albedos fall towards grazing"),
        ("Kurt Fig. 2", "eq. 9 is plausible"),
        ("Kurt Fig. 3", "chosen well, alpha > 0 is plausible too"),
    }
    names = [chart.name for chart in study.charts]
    expected = ["kurt-2", "kurt-3", "gmd-3", "gmd-4", "gmd-5", "gmd-6", "gmd-7", "as-2", "as-4"]
    assert names == [f"papers-{name}" for name in expected]
    curves = {c.label: dict(zip(c.x, c.y, strict=True)) for c in study.charts[0].panels[0].curves}
    for label, values in (("m = 0.1", (0.985, 0.898, 0.720)), ("m = 0.5", (0.700, 0.646, 0.587))):
        assert [curves[label][angle] for angle in (0.0, 60.0, 80.0)] == pytest.approx(values, abs=6e-4)
