"""The best points of a scan, and of one of several lobes beside the best of the others."""

import torch
from fit_cases import measured_from

import brdfcore as bc
from brdfcore.fitting.losses import LOSSES
from brdfcore.fitting.plan import plan
from brdfcore.fitting.problem import Problem
from brdfcore.fitting.projection import Projection
from brdfcore.fitting.starts import _points, _solved, rescan, scan

TWO = "lambert(kd=0.2) + ward_bounded(isotropic, rs={}, a={}) + ward_bounded(isotropic, rs=0.2, a=0.4)"
TRUE = [(0.3, 0.1, 0.1), (0.0, 0.9, 0.02), (0.9, 0.0, 0.2), (0.01, 0.02, 1.2), (0.5, 0.5, 0.05)]
MODEL = "lambert + ward_bounded(isotropic) + ward_bounded(isotropic)"


def test_a_lobe_without_a_place_finds_one() -> None:
    """A lobe whose reflectance is 0 has no slope by its width; the scan beside the other lobe moves it."""
    problem = Problem(plan(1, MODEL), measured_from(TWO.format(0.05, 0.03), noise=1e-4), LOSSES["cosine"])
    projection = Projection(problem)
    start = bc.material(TWO.format(0.0, 3.0)).values()
    x = problem.pack({key: value.detach() for key, value in start.items()}).unsqueeze(0)
    stuck = projection.gram(x)[1]
    assert stuck.gradient[0, problem.slices["ward_bounded.a"]] == 0
    found = rescan(projection, x, 2, seed=0)
    assert found.shape == (1, 4, problem.size)
    assert problem.loss(found[0]).min() < 0.2 * problem.loss(x)[0]
    held = [problem.slices[f"{label}.a"] for label in ("ward_bounded_2", "ward_bounded")]
    for rows, at in zip(found[0].split(2), held, strict=True):
        torch.testing.assert_close(rows[:, at], x[:, at].expand(2, -1), rtol=0, atol=0)


def test_a_scan_that_solves_what_it_needs_finds_the_best_points() -> None:
    """Each as if every point had been solved for within the box; most are not, and some of the best lie on its ends."""
    texts = [f"lambert(kd={kd}) + ward_bounded(isotropic, rs={rs}, a={a})" for kd, rs, a in TRUE]
    several = [measured_from(text, noise=0.3) for text in texts]
    problem = Problem(plan(1, "lambert + ward_bounded(isotropic)"), several, LOSSES["cosine"])
    projection = Projection(problem)
    points = _points(problem, projection, 0)
    _, loss = _solved(projection, points, len(points))
    each = torch.arange(len(several)).repeat_interleave(len(points))
    exact = projection.solved(points.repeat(len(several), 1), each)[1].reshape(loss.shape)
    torch.testing.assert_close(loss, exact, rtol=1e-9, atol=0)
    starts, shares = scan(problem, projection, 3, 0)
    found = problem.loss(starts.flatten(0, 1), torch.arange(len(several)).repeat_interleave(3)).reshape(-1, 3)
    best = exact.sort(dim=1).values[:, :3]
    torch.testing.assert_close(found, best, rtol=1e-9, atol=0)
    torch.testing.assert_close(shares, best / best[:, :1], rtol=1e-9, atol=0)
    _, few = _solved(projection, points, 3)
    assert int((few < exact * (1 - 1e-9)).sum()) > 0
    at_an_end = (starts == problem.low) | (starts == problem.high)
    assert bool(at_an_end.any())
