"""The four materials of Kurt et al. 2010, Table 2, sampled over the azimuth with 2 % noise, come back."""

import pytest
import scipy.stats
import torch
from fit_cases import directions

import brdfcore as bc
from brdfcore.fitting import fit_batch
from brdfcore.models.presets import PRESETS

TABLE_2 = ("brushed_aluminium_kurt", "purple_satin_kurt", "red_velvet_kurt", "yellow_satin_kurt")
MODEL = "lambert + kurt"


def draws(name: str, count: int) -> list[bc.Samples]:
    """Data sets of 1200 directions, half of them near the mirror's, that differ by their noise."""
    wi, wo = directions(1200, 7)
    with torch.no_grad():
        f = bc.material(PRESETS[name].text).f(wi, wo)
    sigma = 0.02 * f
    stream = torch.Generator().manual_seed(2010)
    return [
        bc.Samples(wi, wo, f + sigma * torch.randn(f.shape, generator=stream, dtype=f.dtype), sigma=sigma)
        for _ in range(count)
    ]


def check(name: str, count: int) -> None:
    """Every value of every channel not less often than 95 % by more than chance, Sidak-corrected to 1 %.

    A value that lies on an end of its box counts as held where it is found there.
    """
    fits = fit_batch(draws(name, count), MODEL)
    assert {fit.status for fit in fits} == {"converged"}
    assert fits[0].model == "lambert + kurt(anisotropic, schlick)"
    true = bc.material(PRESETS[name].text).values()
    level = 1 - (1 - 0.01) ** (1 / sum(value.numel() for value in true.values()))
    for key, value in true.items():
        truth = value.detach()
        ends, found = (
            torch.stack([fit.intervals[key] for fit in fits]),
            torch.stack([fit.parameters[key] for fit in fits]),
        )
        held = (((ends[..., 0] <= truth) & (truth <= ends[..., 1])) | (found == truth)).sum(0).reshape(-1)
        for number, times in enumerate(held.tolist()):
            p = scipy.stats.binomtest(times, count, 0.95, alternative="less").pvalue
            assert p > level, f"{key}[{number}]: {times} of {count} intervals hold the true value (p = {p:.2g})"
        if not key.endswith("alpha"):
            width = (ends[..., 1] - ends[..., 0]).nanmedian(0).values
            assert bool((width < 0.1 * truth.clamp(min=1e-4)).all()), (key, width)


@pytest.mark.parametrize("name", TABLE_2)
def test_the_values_of_table_2_come_back(name: str) -> None:
    check(name, 12)


@pytest.mark.full
@pytest.mark.parametrize("name", TABLE_2)
def test_the_values_of_table_2_come_back_from_200_data_sets(name: str) -> None:
    check(name, 200)
