"""`bc.fit_batch` gives what `bc.fit` gives each of the materials alone."""

import time

import pytest
import torch
from fit_cases import TRUE, measured_from

import brdfcore as bc
from brdfcore.errors import BrdfError
from brdfcore.fitting import Progress, fit_batch

MODEL = "lambert + ward_bounded(isotropic)"
OTHER = "lambert(kd=[0.3, 0.2, 0.1]) + ward_bounded(isotropic, rs=[0.2, 0.1, 0.05], a=0.3)"


def alike(together: bc.Fit, alone: bc.Fit) -> None:
    assert (together.status, together.message, together.undetermined) == (
        alone.status,
        alone.message,
        alone.undetermined,
    )
    assert together.objective == pytest.approx(alone.objective, rel=1e-9)
    for name in ("parameters", "standard_errors", "intervals"):
        for key, value in getattr(alone, name).items():
            torch.testing.assert_close(getattr(together, name)[key], value, rtol=1e-5, atol=1e-9, equal_nan=True)
    assert together.errors == pytest.approx(alone.errors, rel=1e-6)
    assert together.provenance == alone.provenance
    assert str(together.material).split("(")[0] == str(alone.material).split("(")[0]


KEYWORDS = {
    "cosine": {},
    "relative": {"loss": "relative"},
    "log": {"loss": "log"},
    "lbfgs": {"optimizer": "lbfgs"},
    "robust": {"robust": "cauchy"},
    "gray": {"gray": ["ward_bounded.rs"]},
    "narrow": {"bounds": {"ward_bounded.a": (0.05, 0.2)}, "max_theta": 1.2},
}


@pytest.mark.parametrize("weigh", [False, True])
@pytest.mark.parametrize("case", KEYWORDS)
def test_each_fit_is_that_of_the_material_alone(case: str, weigh: bool) -> None:
    texts = [TRUE, OTHER, TRUE]
    several = [measured_from(text, noise=0.02 * (i + 1), sigma=weigh) for i, text in enumerate(texts)]
    together = fit_batch(several, MODEL, **KEYWORDS[case])
    for samples, fit in zip(several, together, strict=True):
        alike(fit, bc.fit(samples, MODEL, **KEYWORDS[case]))


def test_materials_that_share_nothing_come_back_in_their_order() -> None:
    several = [
        measured_from(TRUE, noise=0.02, seed=1),
        measured_from("lambert(kd=0.2) + ward_bounded(isotropic, rs=0.1, a=0.2)", noise=0.01, seed=2),
        measured_from(OTHER, noise=0.02, seed=1),
        measured_from(TRUE, count=2500, noise=0.02, seed=3),
    ]
    for samples, fit in zip(several, fit_batch(several, MODEL), strict=True):
        alike(fit, bc.fit(samples, MODEL))


def test_weights_of_their_own_stay_their_own() -> None:
    first = measured_from(TRUE, noise=0.02)
    weight = torch.linspace(0.1, 3, len(first), dtype=torch.float64)
    several = [first, bc.Samples(first.wi, first.wo, first.values * 0.5, weight=weight)]
    for samples, fit in zip(several, fit_batch(several, MODEL), strict=True):
        alike(fit, bc.fit(samples, MODEL))


def test_what_differs_beside_values_and_directions_stays_with_its_material() -> None:
    """Names of channels, and whether sigma or a weight decides, are each material's own."""
    first = measured_from("lambert(kd=[0.2, 0.1])", count=60, noise=0.01, sigma=True)

    def made(**changed: object) -> bc.Samples:
        kept = {"values": first.values, "sigma": first.sigma, **changed}
        return bc.Samples(first.wi, first.wo, **kept)

    weight = torch.linspace(0.1, 3, len(first), dtype=torch.float64)
    several = [
        made(channels=["red", "green"]),
        made(channels=["400", "500"]),
        made(weight=weight),
        made(),
        made(sigma=None, weight=weight),
        made(sigma=None, cell=weight),
        made(sigma=None),
    ]
    for samples, fit in zip(several, fit_batch(several, "lambert + ward_bounded(isotropic)", loss="l2"), strict=True):
        alone = bc.fit(samples, "lambert + ward_bounded(isotropic)", loss="l2")
        alike(fit, alone)
        assert fit.covariance_keys == alone.covariance_keys
        assert (fit.weighed, fit.chi_square is None) == (alone.weighed, alone.chi_square is None)
        assert fit.channels == samples.channels


def test_a_batch_costs_each_fit_its_share() -> None:
    several = [measured_from(TRUE, noise=0.02 * (i + 1)) for i in range(6)]
    seen: list[Progress] = []
    begun = time.perf_counter()
    fits = fit_batch(several, MODEL, progress=seen.append)
    assert 0 < 6 * fits[0].cost.seconds == 6 * fits[5].cost.seconds <= time.perf_counter() - begun
    assert fits[0].cost.evaluations < 3 * bc.fit(several[0], MODEL).cost.evaluations
    assert [p.fraction for p in seen] == sorted(p.fraction for p in seen)
    assert seen[-1].fraction == pytest.approx(1)


def test_a_batch_of_none_is_none() -> None:
    assert fit_batch([], MODEL) == []


def test_what_is_no_samples_is_refused_before_any_work() -> None:
    seen: list[Progress] = []
    with pytest.raises(BrdfError, match=r"^Expected samples to be a list of Samples, got str in it\."):
        fit_batch([measured_from(TRUE), "garnet_red.brdf"], MODEL, progress=seen.append)
    assert seen == []
    wide = bc.Samples([[0, 0, 1]], [[0, 0, 1]], [[0.1, 0.2]])
    with pytest.raises(BrdfError, match="2 channels"):
        fit_batch([measured_from(TRUE), wide], "lambert(kd=[0.1, 0.2, 0.3])", progress=seen.append)
    assert seen == []
