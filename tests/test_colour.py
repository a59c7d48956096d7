"""Colours of spectra: known answers, a peer's numbers for the ColorChecker, and what is refused."""

import pathlib

import numpy as np
import pytest
import torch

from brdfcore import colour
from brdfcore.errors import SamplesError

NM = torch.arange(400, 701, 10, dtype=torch.float64)
PATCHES = np.loadtxt(
    pathlib.Path(__file__).with_name("colour_checker.csv"), delimiter=",", skiprows=2, usecols=range(1, 35)
)
PEER, SPECTRA = torch.tensor(PATCHES[:, :3]), torch.tensor(PATCHES[:, 3:])


def names(nm: torch.Tensor) -> list[str]:
    return [f"{w:g}" for w in nm.tolist()]


@pytest.mark.parametrize(("every", "within"), [(1, 0.0015), (2, 0.007), (3, 0.015)])
def test_colours_are_a_peers_to_what_the_steps_allow(every: int, within: float) -> None:
    weights = colour.weights(NM[::every])
    error = float((SPECTRA[:, ::every] @ weights - PEER).abs().max())
    assert 0.1 * within < error < within, "the numbers of colour.py"


def test_white_is_white_and_its_chromaticity_that_of_d65() -> None:
    for nm in (NM, NM[[0, 30]], torch.linspace(360, 1000, 195).double(), torch.tensor([550.0]), NM + 0.123):
        torch.testing.assert_close(colour.weights(nm).sum(0), torch.ones(3).double(), rtol=0, atol=1e-14)
    white = colour._response()[1].sum(0)
    # CIE 15:2004, table 11.3 prints 0.31272, 0.32903
    assert white[:2] / white.sum() == pytest.approx([0.31272, 0.32903], abs=5e-6)


def test_the_primaries_are_srgbs() -> None:
    """M of IEC 61966-2-1, to its four digits."""
    white = colour._response()[1].sum(0)
    to_rgb = np.linalg.inv(colour._primaries().T)
    to_rgb /= (to_rgb @ (white / white[1]))[:, None]
    printed = [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
    assert to_rgb == pytest.approx(np.array(printed), abs=1e-3)


def test_order_and_wavelengths_that_nobody_sees_do_not_matter() -> None:
    turned = colour.weights(NM.flip(0)).flip(0)
    torch.testing.assert_close(turned, colour.weights(NM), rtol=0, atol=1e-15)
    wide = colour.weights(torch.cat([NM, torch.tensor([790.0, 1064.0], dtype=torch.float64)]))
    assert (wide[:-2] - colour.weights(NM)).abs().max() < 1e-3
    assert wide[-1].abs().max() == 0
    fine = torch.linspace(380, 780, 173, dtype=torch.float64)  # between the table's steps
    spectra = torch.tensor(np.array([np.interp(fine, NM, row) for row in SPECTRA]))
    torch.testing.assert_close(spectra @ colour.weights(fine), SPECTRA @ colour.weights(NM), rtol=0, atol=1e-3)


def test_how_much_is_covered() -> None:
    assert colour.covered(NM) == pytest.approx(0.9969, abs=1e-4)
    assert colour.covered(torch.tensor([300.0, 1000.0])) == 1
    assert colour.told(NM) == "31 wavelengths, 400 to 700 nm, 99.7% of what the eye sees"
    assert colour.covered(torch.tensor([900.0, 1000.0])) == 0


def test_names_are_wavelengths_or_not() -> None:
    assert colour.wavelengths(["550.5nm", "400", "700 nm"]).tolist() == [550.5, 400, 700]
    for others in (["0", "1"], ["0.55", "0.6"], ["r", "g", "b"], ["550", "c1"], ["550", "550 nm"], ["-550"], []):
        assert colour.wavelengths(others) is None


@pytest.mark.parametrize(
    ("channels", "words"),
    [
        (["r", "500", "600", "650", "700"], "be named by wavelengths in nm, got r, 500, 600, 650, ..."),
        (["value"], "be named by wavelengths in nm, got value."),
        (["351", "532", "633", "1064"], "lie at most 30 nm apart, got a step of 152 nm."),
        (names(NM[5:26]), "as 420 to 680 nm do, got 21 wavelengths, 450 to 650 nm, 57.1% of what the eye sees."),
        (
            ["900", "1000"],
            "span 90% of what the eye sees, as 420 to 680 nm do, got 2 wavelengths, 900 to 1000 nm, 0.0%",
        ),
    ],
)
def test_what_has_no_colour_is_refused(channels: list[str], words: str) -> None:
    with pytest.raises(SamplesError, match=r"Expected the channels of a spectrum to .*Leave rgb out") as refused:
        colour.of_spectrum(channels)
    assert words in refused.value.message
    assert refused.value.field == "rgb"


def test_the_coarsest_spectrum_that_is_taken() -> None:
    coarsest = torch.arange(410, 691, 28)  # 30 nm does not divide the span that is asked for
    assert torch.equal(colour.of_spectrum(names(coarsest)), colour.weights(coarsest))
