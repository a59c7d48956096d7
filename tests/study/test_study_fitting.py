"""The study of fitting: peers and library minimise the same sum, and the traces say how soon."""

import math

import numpy as np
import pytest
import torch

from brdfcore.fitting.data import root_weights
from brdfcore.fitting.losses import LOSSES
from brdfcore.study import STUDIES, _peers
from brdfcore.study import fitting as module
from brdfcore.study._fit_cases import LINOLEUM, case, generated, start


@pytest.mark.parametrize("size", [LINOLEUM, 300])
def test_peers_have_the_librarys_residuals(size: int) -> None:
    made = case(size, seed=5)
    x = start(made.problem, seed=2)
    natural = np.array([float(made.problem.unpack(x)[key]) for key in made.problem.keys])
    samples = made.samples
    weight = root_weights(samples, LOSSES["cosine"]).expand_as(samples.values)[:, 0]
    theirs = _peers.Residuals(samples.wi.numpy(), samples.wo.numpy(), samples.values[:, 0].numpy(), weight.numpy())
    ours = made.problem.jacobian(x.unsqueeze(0), made.problem.data)[0][0, 0]
    torch.testing.assert_close(torch.from_numpy(theirs(natural)), ours, rtol=1e-10, atol=1e-12)


def test_generated_samples_are_seeded_and_of_the_known_material() -> None:
    first, again, other = generated(200, 1), generated(200, 1), generated(200, 2)
    assert torch.equal(first.values, again.values)
    assert not torch.equal(first.values, other.values)
    assert len(first) == 200
    assert first.azimuth_observed


def test_starts_lie_in_the_search_ranges() -> None:
    problem = case(LINOLEUM, 0).problem
    starts = torch.stack([start(problem, seed) for seed in range(20)])
    assert bool((starts >= problem.low).all())
    assert bool((starts <= problem.high).all())
    assert bool((starts.std(0) > 0).all())


@pytest.fixture(scope="module")
def study():
    return STUDIES["fitting"](sizes=(LINOLEUM,), starts=1, adam_steps=3)


def test_who_reaches_the_minimum_is_found(study) -> None:
    hits = {row[1]: row[3] for row in study.rows}
    assert hits["least_squares"] == hits[module._WHOLE] == 1
    assert hits["adam"] == 0, "three steps are not enough"
    errors = {row[1]: row[6] for row in study.rows}
    assert errors["least_squares"] < 1e-9
    assert errors["adam"] > 1
    assert study.sentence.startswith("At 222 samples take ")
    assert "adam 0" in study.sentence
    (panel,) = study.charts[0].panels
    for curve in panel.curves:
        assert list(curve.x) == sorted(curve.x)
        assert list(curve.y) == sorted(curve.y, reverse=True), "the best so far never rises"


@pytest.mark.parametrize("name", ["scipy", "lmfit"])
def test_peers_reach_the_minimum(study, name: str) -> None:
    pytest.importorskip(name)
    label = _peers.PEERS[name][0]
    row = next(row for row in study.rows if row[1] == label)
    assert row[3] == 1
    assert row[6] < 1e-6


def test_a_peer_that_is_not_installed_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "installed", lambda name: None)
    monkeypatch.setattr(module, "_OURS", {"least_squares": module.least_squares})
    found = STUDIES["fitting"](sizes=(LINOLEUM,), starts=1)
    assert {row[1] for row in found.rows} == {"least_squares", module._WHOLE}
    assert "scipy is not installed, so it is not compared." in found.notes
    assert "lmfit is not installed, so it is not compared." in found.notes


def test_the_lowest_so_far() -> None:
    trace = [(0.1, 5.0), (0.2, 7.0), (0.3, 2.0), (0.4, math.nan), (0.5, 3.0)]
    assert module._lowest(trace) == [(0.1, 5.0), (0.3, 2.0), (0.5, 2.0)]


def test_the_sentence_is_computed() -> None:
    def table(size: int, own: float, hits: int) -> list[tuple]:
        return [
            (size, "least_squares", 3, hits, own if hits else None, 1.0, 0.0),
            (size, "lbfgs", 3, 2, 0.1, 1.0, 0.0),
            (size, "adam", 3, 0, None, 1.0, 1.0),
            (size, "scipy least_squares (trf)", 3, 3, 0.4, 1.0, 0.0),
        ]

    text = module._sentence([*table(222, 0.2, 3), *table(5000, 0.2, 1), *table(100000, 2.0, 1)])
    assert text.startswith(
        "At 222 samples take least_squares, within 1e-06 of the minimum from 3 of 3 starts after 0.2 s"
    )
    assert "lbfgs 2 in 0.5x the time, adam 0, scipy least_squares (trf) 3 in 2x the time" in text
    assert "at 100000 samples take lbfgs" in text, "the surer one"
    assert "5000" not in text
    nowhere = [(*row[:3], 0, None, 1.0, 1.0) for row in table(222, 0.2, 3)]
    assert "none of the library's methods" in module._sentence(nowhere)
