"""The methods that are there to be compared: what they claim holds, or they say that they do not know."""

import math

import numpy as np
import pytest
import torch
from albedo_cases import CHOICES, random_case

import brdfcore as bc

SEED = 20100629
DIRECTIONS = 4
REFERENCE = 1e-9


@pytest.mark.parametrize("method", ["monte_carlo", "sobol"])
@pytest.mark.parametrize("text", ["ward_bounded(rs=[0.2, 0.9], a=0.2) + lambert(kd=[0.1, 0.4])", "ggx(ks=1, a=0.5)"])
def test_samples_agree(text, method):
    material = bc.material(text)
    theta = torch.tensor([0.0, 0.8, 1.3])
    with torch.no_grad():
        found, drawn = bc.albedo(material, theta), bc.albedo(material, theta, tolerance=4e-3, method=method)
    assert drawn.met
    assert drawn.method == method
    assert bool(((found.values - drawn.values).abs() <= drawn.error).all())
    assert bool((drawn.error > 1e-6).all())
    again = bc.albedo(material, theta, tolerance=4e-3, method=method)
    assert torch.equal(again.values.detach(), drawn.values)


@pytest.mark.parametrize(
    ("method", "cases", "share"),
    [
        # hemisphere knows nothing of a lobe but its samples: features that no node meets stay unknown
        ("hemisphere", 40, 0.03),
        pytest.param("hemisphere", 2_000, 0.03, marks=pytest.mark.full),
        ("monte_carlo", 8, 0.0),
        pytest.param("monte_carlo", 1_000, 2e-3, marks=pytest.mark.full),
        ("sobol", 8, 0.0),
        pytest.param("sobol", 1_000, 2e-3, marks=pytest.mark.full),
        ("gauss_legendre", 4, 0.0),
        pytest.param("gauss_legendre", 200, 0.02, marks=pytest.mark.full),
    ],
)
def test_claims_hold(method, cases, share):
    """In all cases but a share, over materials, angles to 89.999 degrees, and tolerances from 1e-4 to 0.03."""
    rng = np.random.default_rng(SEED)
    wrong = []
    for _ in range(cases // DIRECTIONS):
        case = random_case(rng, CHOICES[int(rng.integers(len(CHOICES)))], DIRECTIONS)
        tolerance = float(10 ** rng.uniform(-4, -1.5))
        found, reference = case.albedo(tolerance, method), case.albedo(REFERENCE)
        assert not bool((found.values.isnan() | found.error.isnan()).any()), case
        scale = reference.values.clamp(min=1)
        assert found.met == bool((found.error <= tolerance * found.values.clamp(min=1)).all())
        certain = reference.error.isfinite() & reference.values.isfinite()
        error = torch.where(certain, found.values - reference.values, 0.0).abs()
        bad = certain & (error > found.error + reference.error + 4e-15 * scale)
        wrong += [(case, row) for row in torch.nonzero(bad)[:, 0].tolist()]
    assert len(wrong) <= share * cases, wrong


@pytest.mark.parametrize("a", [0.1, 1.0])
def test_cells_see_the_layer_at_the_horizon(a):
    """At 89.99 degrees f cos theta_i rises from 0 within cos theta_i = 2e-4, along a curve through the square."""
    material = bc.material(f"ward_bounded(rs=1, a={a})")
    theta = math.radians(89.99)
    with torch.no_grad():
        exact = float(bc.albedo(material, theta, tolerance=1e-12).values)
        for tolerance in (1e-2, 1e-3, 1e-4):
            found = bc.albedo(material, theta, tolerance=tolerance, method="hemisphere")
            assert abs(float(found.values) - exact) <= float(found.error)


def test_samples_that_weigh_alike_do_not_claim_to_know_all():
    """A narrow lobe far from the horizon: every weight is 1 to rounding, what falls below the horizon is not met."""
    lobe = bc.material("cook_torrance(constant, ks=1, a=0.7)")
    theta = math.radians(89.998)
    for method in ("monte_carlo", "sobol"):
        with torch.no_grad():
            found = bc.albedo(lobe, theta, tolerance=0.02, method=method)
            exact = bc.albedo(lobe, theta, tolerance=1e-9)
        assert abs(float(found.values) - float(exact.values)) <= float(found.error)
        assert float(found.error) > 1e-4


def test_the_textbook_rule_is_right_for_wide_lobes():
    wide = bc.material("ward_bounded(rs=1, a=0.5)")
    with torch.no_grad():
        found, exact = (bc.albedo(wide, 0.5, tolerance=1e-8, method=m) for m in ("gauss_legendre", "auto"))
    assert found.met
    assert abs(float(found.values) - float(exact.values)) <= float(found.error + exact.error)


@pytest.mark.parametrize("text", ["ward_bounded(rs=1, a=0.0005)", "lafortune(ks=1, cx=-1, cy=-1, n=1000000)"])
def test_the_textbook_rule_says_that_it_misses_narrow_lobes(text):
    """Its nodes are farther apart than the lobe is wide, so that all its sizes agree on next to nothing."""
    with torch.no_grad():
        missed = bc.albedo(bc.material(text), 0.5, tolerance=1e-3, method="gauss_legendre")
        exact = bc.albedo(bc.material(text), 0.5, tolerance=1e-9)
    assert not missed.met
    assert abs(float(missed.values) - float(exact.values)) <= float(missed.error)
