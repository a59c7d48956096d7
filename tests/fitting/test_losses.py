"""The losses against their definitions, evaluated by hand."""

import math

import numpy as np
import pytest
import torch
from fit_cases import TRUE, measured_from

import brdfcore as bc
from brdfcore.fitting import errors
from brdfcore.fitting.losses import LOSSES, Scales


@pytest.fixture(scope="module")
def noisy() -> bc.Samples:
    return measured_from(TRUE, count=50, noise=0.02)


def by_hand(samples: bc.Samples, weight: np.ndarray, cell: np.ndarray) -> dict[str, float]:
    """The losses of models.md as NumPy writes them."""
    f = bc.material(TRUE).f(samples.wi, samples.wo).detach().numpy()
    y, c = samples.values.numpy(), samples.wi[:, 2:].numpy()
    w = weight[:, None]
    d = 0.01 * torch.tensor(y[y > 0]).median().item()
    e = 0.01 * torch.tensor((c * y)[y > 0]).median().item()
    positive = np.maximum(y, 0)
    wc = w * cell[:, None]
    return {
        "cosine": np.sum(w * (c * f - c * y) ** 2),
        "cosine_rms": math.sqrt(np.sum(w * (c * f - c * y) ** 2) / (3 * w.sum())),
        "l2": math.sqrt(np.sum(wc * (c * f - c * y) ** 2) / (3 * wc.sum())),
        "log": np.sum(w * (np.log(1 + c * f) - np.log(1 + c * positive)) ** 2),
        "cube_root": np.sum(w * (np.cbrt(c * f + e) - np.cbrt(c * positive + e)) ** 2),
        "relative": np.sum(w * ((f - y) / (positive + d)) ** 2),
    }


def test_errors_are_the_definitions(noisy: bc.Samples) -> None:
    assert bool((noisy.values < 0).any()), "the case must hold negative values"
    ones = np.ones(len(noisy))
    assert errors(bc.material(TRUE), noisy) == pytest.approx(by_hand(noisy, ones, ones), rel=1e-11)


def test_weights_and_cells_enter_as_defined(noisy: bc.Samples) -> None:
    weight, cell = np.linspace(0.5, 2, len(noisy)), np.linspace(1, 3, len(noisy))
    weighted = bc.Samples(noisy.wi, noisy.wo, noisy.values, weight=weight, cell=cell)
    assert errors(bc.material(TRUE), weighted) == pytest.approx(by_hand(weighted, weight, cell), rel=1e-11)


@pytest.mark.parametrize("name", LOSSES)
def test_difference_is_zero_where_model_and_measurement_agree(name: str) -> None:
    y = torch.tensor([[0.0, 1e-9, 0.3, 40.0]], dtype=torch.float64)
    c = torch.tensor([[0.4]], dtype=torch.float64)
    assert LOSSES[name].difference(y, y, c, Scales.of(y, c)).abs().max() == 0


@pytest.mark.parametrize("name", LOSSES)
def test_slope_is_finite_at_zero(name: str) -> None:
    f = torch.zeros(1, 1, dtype=torch.float64, requires_grad=True)
    y, c = torch.zeros(1, 1, dtype=torch.float64), torch.full((1, 1), 0.5, dtype=torch.float64)
    slope = torch.autograd.grad(LOSSES[name].difference(f, y, c, Scales.of(y, c)).sum(), f)[0]
    assert bool(slope.isfinite())
    assert float(slope) > 0
