"""Red, green and blue of any channels, for the eye: as they are where there are three, else by their wavelengths."""

from collections.abc import Sequence

from torch import Tensor

from ..colour import wavelengths, weights

FEWEST = 3  # channels that make a colour
VISIBLE = (380.0, 780.0)  # [nm]


def to_rgb(pixels: Tensor, channels: Sequence[str]) -> Tensor | None:
    """Linear red, green and blue (..., 3) of pixels (..., C) of channels of such names; None without a colour.

    Names that are wavelengths in nm make a spectrum, however coarse; three other names are red, green and blue in this
    order; a single channel is gray. What exceeds the colours of sRGB is cut off at 0.
    """
    if len(channels) == 1:
        return pixels.expand(*pixels.shape[:-1], 3)
    pixels = pixels.expand(*pixels.shape[:-1], len(channels))
    nm = wavelengths(channels)
    if nm is not None and int(((nm >= VISIBLE[0]) & (nm <= VISIBLE[1])).sum()) >= FEWEST:
        return (pixels @ weights(nm).to(pixels)).clamp(min=0)
    return pixels if len(channels) == FEWEST else None
