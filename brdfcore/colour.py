"""Linear sRGB of a spectrum: what the CIE 1931 observer sees of a reflectance under daylight D65.

    X = integral of xbar(w) S(w) R(w) dw, Y and Z alike;   RGB = M (X, Y, Z), a perfect white being (1, 1, 1)

R, given at some wavelengths, is taken as linear between them, and as constant beyond the first and the last, as ASTM
E308 takes it; the integral is trapezoidal over those wavelengths and the tables' own, 380 to 780 nm by 5 nm. M follows
from the chromaticities of sRGB's primaries (IEC 61966-2-1) and the tables' white. A colour that sRGB does not hold is
negative in a channel. Over the 24 patches of the ColorChecker, values every 10 nm from 400 to 700 nm are within 0.0015
of the whole spectrum's, every 20 nm within 0.007, every 30 nm within 0.015 (tests/test_colour.py).
"""

import functools
import re
from collections.abc import Sequence
from importlib import resources
from typing import Final

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from .errors import SamplesError

Array = npt.NDArray[np.float64]

RGB: Final = ("r", "g", "b")
SHORTEST: Final = 100.0  # wavelength [nm]; smaller numbers count channels, or are micrometres
WIDEST: Final = 30.0  # step between wavelengths [nm], above which a spectrum is guesswork
LEAST: Final = 0.9  # share of the response between the first and the last wavelength, below which it is

_FILE = "cie_1931_d65.csv"
_PRIMARIES = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))  # chromaticities x, y
_NAME = re.compile(r"(\d+(?:\.\d+)?)\s*(?:nm)?")


def wavelengths(channels: Sequence[str]) -> Tensor | None:
    """The wavelengths (C,) [nm] that channels are named by, as "550" or "550 nm"; None where they are not."""
    numbers = [float(match[1]) for match in map(_NAME.fullmatch, channels) if match]
    if len(set(numbers)) < len(channels) or min(numbers, default=0.0) < SHORTEST:
        return None
    return torch.tensor(numbers, dtype=torch.float64)


def weights(nm: Tensor) -> Tensor:
    """The weights (C, 3) [1] that take values at wavelengths (C,) [nm] to linear sRGB; each channel's add up to 1."""
    table, _ = _response()
    given = nm.double().numpy()
    order = np.argsort(given)
    knots = np.union1d(table, np.clip(given, table[0], table[-1]))
    shares = np.stack([np.interp(knots, given[order], row) for row in np.eye(len(given))])
    seen = np.trapezoid(shares[:, :, None] * _at(knots), knots, axis=1) @ np.linalg.inv(_primaries())
    found = np.empty_like(seen)
    found[order] = seen / seen.sum(0)
    return torch.from_numpy(found)


def covered(nm: Tensor) -> float:
    """The share [1] of the response to a white between the first and the last wavelength; of X, Y and Z the least."""
    table, response = _response()
    first, last = np.clip([float(nm.min()), float(nm.max())], table[0], table[-1])
    knots = np.concatenate([[first], table[(table > first) & (table < last)], [last]])
    return float((np.trapezoid(_at(knots), knots, axis=0) / np.trapezoid(response, table, axis=0)).min())


def of_spectrum(channels: Sequence[str]) -> Tensor:
    """The weights (C, 3) for channels of such names; SamplesError where they are no spectrum that has a colour."""
    nm = wavelengths(channels)
    if nm is None:
        raise _no_spectrum("be named by wavelengths in nm", ", ".join(channels[:4]) + ", ..." * (len(channels) > 4))
    if covered(nm) < LEAST:
        raise _no_spectrum(f"span {LEAST:.0%} of what the eye sees, as 420 to 680 nm do", told(nm))
    table, _ = _response()
    step = float(nm.clamp(table[0], table[-1]).sort().values.diff().max())
    if step > WIDEST:
        raise _no_spectrum(f"lie at most {WIDEST:g} nm apart", f"a step of {step:g} nm")
    return weights(nm)


def told(nm: Tensor) -> str:
    """The wavelengths in words: how many, from where to where, and how much of what the eye sees they span."""
    ends = f"{float(nm.min()):g} to {float(nm.max()):g} nm" if len(nm) > 1 else f"{float(nm):g} nm"
    return f"{len(nm)} wavelength{'s' * (len(nm) > 1)}, {ends}, {covered(nm):.1%} of what the eye sees"


def _no_spectrum(rule: str, got: str) -> SamplesError:
    return SamplesError(
        f"Expected the channels of a spectrum to {rule}, got {got}. Leave rgb out, and take the channels as they are.",
        field="rgb",
    )


def _at(nm: Array) -> Array:
    """The response (K, 3) at wavelengths (K,) within the table."""
    table, response = _response()
    return np.stack([np.interp(nm, table, column) for column in response.T], -1)


@functools.cache
def _response() -> tuple[Array, Array]:
    """The table's wavelengths (K,) [nm], and the response (K, 3) of the observer to a white under D65 there."""
    with resources.files("brdfcore.data").joinpath(_FILE).open(encoding="utf-8") as file:
        nm, *observer, daylight = np.loadtxt(file, delimiter=",", skiprows=3).T
    return nm, np.stack(observer, -1) * daylight[:, None]


def _primaries() -> Array:
    """X, Y and Z of red, green and blue, a row each, for Y = 1."""
    return np.array([(x / y, 1.0, (1 - x - y) / y) for x, y in _PRIMARIES])
