"""Values on an end of their box: held there by the data, or there by chance."""

import torch
from fit_cases import measured_from

import brdfcore as bc
from brdfcore.fitting.ends import certain
from brdfcore.fitting.problem import Gram

MODEL = "lambert + ward_bounded(isotropic)"


def held(gradient: list[float], matrix: list[list[float]]) -> list[bool]:
    """Which of the values that press on their low ends noise of variance 1 does not put there."""
    push, square = torch.tensor([gradient], dtype=torch.float64), torch.tensor([matrix], dtype=torch.float64)
    pressed = push > 0
    return certain(Gram(torch.ones(1), push, square), pressed, torch.zeros_like(pressed), square)[0].tolist()


def test_a_value_is_held_beyond_two_standard_errors() -> None:
    assert held([1.9, 0.0], [[1, 0.5], [0.5, 1]]) == [True, False]  # the second follows: its standard error is 1.15
    assert held([1.7, 0.0], [[1, 0.5], [0.5, 1]]) == [False, False]
    assert held([0.0, 0.0], [[1, 0.5], [0.5, 1]]) == [False, False]


def test_values_that_only_together_lie_beyond_are_held() -> None:
    """Two that undo each other: what the data know is their sum, and that is far beyond both ends."""
    assert held([1.9, 1.9], [[1, -0.99], [-0.99, 1]]) == [True, True]
    assert held([1.9, 1.9], [[1, 0.0], [0.0, 1]]) == [False, False]


def test_a_value_that_the_data_hold_on_its_end_has_no_interval() -> None:
    """No lobe in the data, and a diffuse term of -0.05: the noise does not explain that."""
    samples = measured_from("lambert(kd=0.2)", noise=0.001, sigma=True)
    low = bc.Samples(samples.wi, samples.wo, samples.values - 0.08, sigma=samples.sigma)
    fit = bc.fit(low, "lambert")
    assert float(fit.parameters["lambert.kd"]) == 0
    assert bool(fit.intervals["lambert.kd"].isnan().all())
    assert "lambert.kd ended on an end of the box, so no interval is given there." in fit.message


def test_a_value_that_noise_put_on_its_end_has_an_interval_inwards() -> None:
    """Half of the data sets of a black ground end at kd = 0; a fortieth lies more than two standard errors beyond."""
    several = [
        measured_from("lambert(kd=0) + ward_bounded(isotropic, rs=0.1, a=0.15)", noise=0.01, seed=seed, sigma=True)
        for seed in range(6)
    ]
    fits = [bc.fit(samples, MODEL) for samples in several]
    ended = [fit for fit in fits if float(fit.parameters["lambert.kd"]) == 0]
    assert ended
    for fit in ended:
        low, high = fit.intervals["lambert.kd"].tolist()
        assert low == 0
        assert 0 < high < 0.02
        assert (
            "lambert.kd ended on an end of the box, where noise alone may have put it, so the interval" in fit.message
        )
        assert float(fit.standard_errors["lambert.kd"]) > 0
