"""What the directional albedo claims of itself, over random materials, angles and tolerances, against a reference.

The reference is the albedo to 1e-4 of the tolerance, 1e-13 at least, whose rules are checked against others in
test_albedo_rules.py. A claim is honest where the true error is at most the claimed one. By Clopper and Pearson's bound
at the 1 % level, more dishonest claims than `allowed` of n would refute that at most 0.1 % are.
"""

import numpy as np
import pytest
import torch
from albedo_cases import CHOICES, FLOOR, random_case

import brdfcore as bc

SEED = 20100629
DIRECTIONS = 4
REFERENCE = 1e-13
FINER = 1e-4  # of a case's tolerance
SHARE = 1e-3  # of dishonest claims


def allowed(n: int) -> int:
    """The largest number of dishonest claims of n that is not too rare for a share of SHARE."""
    probability, count, below = (1 - SHARE) ** n, 0, 0.0
    while below + probability < 0.99:
        below += probability
        count += 1
        probability *= (n - count + 1) / count * SHARE / (1 - SHARE)
    return count


def test_the_bound_itself():
    """0.999^200 = 0.82, 0.98 with one: two are too rare only beyond that; 20,000: 20 expected, 31 at the 1 % level."""
    assert (allowed(200), allowed(20_000)) == (2, 31)


@pytest.mark.parametrize("cases", [120, pytest.param(20_000, marks=pytest.mark.full)])
def test_claims_are_honest_met_and_tight(cases: int):
    rng = np.random.default_rng(SEED)
    true, claimed, dishonest = [], [], []
    for index in range(cases // DIRECTIONS):
        case = random_case(rng, CHOICES[(index + int(rng.integers(len(CHOICES)))) % len(CHOICES)], DIRECTIONS)
        found, reference = case.albedo(), case.albedo(max(REFERENCE, FINER * case.tolerance))
        assert not bool((found.values.isnan() | found.error.isnan()).any()), case
        assert found.values.shape == found.error.shape == (DIRECTIONS, 1)
        within = found.error <= case.tolerance * found.values.clamp(min=1)
        assert found.met == bool(within.all())
        error = (found.values - reference.values).abs()
        certain = reference.error.isfinite() & found.error.isfinite()
        wrong = certain & (error > found.error + reference.error)
        dishonest += [(case, *row) for row in torch.nonzero(wrong).tolist()]
        scale = found.values.clamp(min=1)
        true += (error / scale).clamp(min=FLOOR)[certain].tolist()
        claimed += (found.error / scale)[certain].tolist()
    assert len(true) >= 0.95 * cases
    assert len(dishonest) <= allowed(len(true)), dishonest
    assert np.median(np.array(claimed) / np.array(true)) <= 100


@pytest.mark.parametrize("count", [40, pytest.param(4_000, marks=pytest.mark.full)])
def test_a_reference_to_1e_12_is_within_reach(count: int):
    """Of every model, in its whole box, at every angle to 89.999 degrees (but where the lobe itself overflows)."""
    rng = np.random.default_rng(SEED + 1)
    missed = []
    for index in range(count):
        case = random_case(rng, CHOICES[index % len(CHOICES)], DIRECTIONS)
        found = case.albedo(1e-12)
        bad = (found.error > 1e-12 * found.values.clamp(min=1)) & found.error.isfinite()
        if bool(bad.any()):
            missed.append((case, found.error[bad].tolist()))
    assert not missed


def test_a_small_coefficient_takes_nothing_of_the_tolerance():
    """The tolerance is of the albedo: a basis of 719 whose coefficient is small must not stand in for it."""
    material = bc.material("kurt(isotropic, schlick, ks=0.6078, f0=0.0124, m=1.9011, alpha=0.7742)")
    theta = torch.acos(torch.tensor([1.5932e-4], dtype=torch.float64))
    found = bc.albedo(material, theta, 3.1282, 1e-12)
    assert found.met, f"{float(found.error.detach()):.2e} of {float(found.values.detach()):.4g}"
