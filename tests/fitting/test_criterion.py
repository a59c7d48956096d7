"""The information criterion on residuals whose noise is known, and on such as no noise makes."""

import math

import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from brdfcore.fitting.criterion import Spread, gain
from brdfcore.fitting.signal_noise import noise, variances

ALLOWED, NEAR = 3, 20  # as the docstrings say


def spread(squares: torch.Tensor, leverage: torch.Tensor, signal: torch.Tensor, values: int, channels: int) -> Spread:
    return Spread(squares, leverage, signal, float(squares.mean()), values, channels)


def test_even_noise_costs_what_schwarz_says() -> None:
    n = 400
    signal = torch.linspace(1, 2, n, dtype=torch.float64)
    leaner = spread(torch.ones(n, dtype=torch.float64), torch.full_like(signal, 2 / n), signal, 2, 1)
    richer = leaner._replace(squares=leaner.squares * (1 - 5 / n), leverage=torch.full_like(signal, 5 / n), values=5)
    assert abs(gain(richer, leaner) - (3 * math.log(n) - 5)) < 0.02 * 3 * math.log(n)


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), channels=st.sampled_from([1, 3, 31]), spike=st.floats(-6, 6))
def test_what_takes_away_more_than_it_leaves_is_called_for_however_the_residuals_lie(
    seed: int, channels: int, spike: float
) -> None:
    """The bound of the module's docstring, for residuals and signals over twelve decades."""
    g = torch.Generator().manual_seed(seed)
    n = 40 * channels
    size, signal = (torch.randn(n, generator=g, dtype=torch.float64).mul(abs(spike) + 1).exp() for _ in range(2))
    leverage = torch.rand(n, generator=g, dtype=torch.float64).pow(8)
    signal[:3] *= 10**spike
    richer = spread(size, leverage, signal, 4, channels)
    left = float((size / (1 - leverage).clamp(min=1e-3)).sum())
    bound = ALLOWED * float(leverage.sum()) * math.log(n) / (NEAR * channels) * left
    leaner = spread(size + 1.001 * bound / n, torch.zeros_like(leverage), signal, 1, channels)
    assert gain(richer, leaner) < 0


def test_misfit_of_flanks_makes_no_noise_at_the_peak() -> None:
    """Flanks off by half, dark samples exact to 1e-3, and a peak, as high as a hundred flanks, that is met."""
    signal = torch.cat([torch.full((300,), 0.01), torch.full((60,), 1.0), torch.full((20,), 100.0)]).double()
    squares = torch.cat([torch.full((300,), 1e-6), torch.full((60,), 0.25), torch.full((20,), 0.04)]).double()
    assert float(noise(squares, signal).variance(signal)[-1]) > 10 * squares.sum()
    assert float(variances(squares, signal, 20)[-1]) <= 1.0001 * ALLOWED * 0.04


def test_relative_noise_is_left_as_it_is() -> None:
    """What signals next to each other show is hardly ever so little by chance that it changes a variance."""
    g = torch.Generator().manual_seed(0)
    signal = torch.randn(2000, generator=g, dtype=torch.float64).exp()
    squares = (0.02 * signal * torch.randn(2000, generator=g, dtype=torch.float64)).square()
    likeliest = noise(squares, signal).variance(signal)
    assert float((variances(squares, signal, 20) < 0.99 * likeliest).double().mean()) < 0.02
