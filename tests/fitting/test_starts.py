"""Starts of the shapes of one lobe beside the best of the others."""

import torch
from fit_cases import measured_from

import brdfcore as bc
from brdfcore.fitting.losses import LOSSES
from brdfcore.fitting.plan import plan
from brdfcore.fitting.problem import Problem
from brdfcore.fitting.projection import Projection
from brdfcore.fitting.starts import rescan

TWO = "lambert(kd=0.2) + ward_bounded(isotropic, rs={}, a={}) + ward_bounded(isotropic, rs=0.2, a=0.4)"
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
