"""Red, green and blue of any channels: as they are where there are three, by the eye's response to a spectrum.

    X = sum of xbar(lambda) R(lambda), Y and Z alike;  linear sRGB = M (X, Y, Z), then scaled so that white is white

Colour matching functions of the CIE 1931 observer as sums of lopsided Gaussians (Wyman, Sloan and Shirley 2013, JCGT
2(2), section 2), within some percent of the tables, which is enough for a preview. M is that of IEC 61966-2-1.
"""

import re
from collections.abc import Sequence

import torch
from torch import Tensor

# weight, centre [nm], width below and above it [nm]
_OBSERVER = (
    ((1.056, 599.8, 37.9, 31.0), (0.362, 442.0, 16.0, 26.7), (-0.065, 501.1, 20.4, 26.2)),
    ((0.821, 568.8, 46.9, 40.5), (0.286, 530.9, 16.3, 31.1)),
    ((1.217, 437.0, 11.8, 36.0), (0.681, 459.0, 26.0, 13.8)),
)
_TO_SRGB = ((3.2406, -1.5372, -0.4986), (-0.9689, 1.8758, 0.0415), (0.0557, -0.2040, 1.0570))
VISIBLE = (380.0, 780.0)  # [nm]
FEWEST = 3  # wavelengths that make a colour


def to_rgb(pixels: Tensor, channels: Sequence[str]) -> Tensor | None:
    """Linear red, green and blue (..., 3) of pixels (..., C) of channels of such names; None without a colour.

    Names that are wavelengths in nm make a spectrum; three other names are red, green and blue in this order; a single
    channel is gray. What exceeds the colours of sRGB is cut off at 0.
    """
    if len(channels) == 1:
        return pixels.expand(*pixels.shape[:-1], 3)
    pixels = pixels.expand(*pixels.shape[:-1], len(channels))
    wavelengths = [float(name[1]) for name in (re.fullmatch(r"(\d+(?:\.\d+)?)\s*(?:nm)?", c) for c in channels) if name]
    if len(wavelengths) == len(channels) >= FEWEST and all(VISIBLE[0] <= x <= VISIBLE[1] for x in wavelengths):
        return (pixels @ _weights(torch.tensor(wavelengths, dtype=pixels.dtype))).clamp(min=0)
    return pixels if len(channels) == FEWEST else None


def _weights(wavelengths: Tensor) -> Tensor:
    """The (C, 3) weights of wavelengths [nm] in linear sRGB; those of a colour add up to 1."""
    order = torch.argsort(wavelengths)
    steps = torch.empty_like(wavelengths)
    steps[order] = torch.gradient(wavelengths[order])[0].abs()  # spacing need not be even
    observer = torch.stack([_response(parts, wavelengths) for parts in _OBSERVER], dim=-1)
    weights = (observer * steps.unsqueeze(-1)) @ wavelengths.new_tensor(_TO_SRGB).T
    return weights / weights.sum(0)


def _response(parts: Sequence[tuple[float, ...]], wavelengths: Tensor) -> Tensor:
    total = torch.zeros_like(wavelengths)
    for weight, centre, below, above in parts:
        width = torch.where(wavelengths < centre, below, above)
        total = total + weight * torch.exp(-0.5 * ((wavelengths - centre) / width).square())
    return total
