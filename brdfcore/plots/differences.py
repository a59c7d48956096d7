"""Images above what they differ by from their references, as Kurt, Szirmay-Kalos and Krivanek 2010 show theirs.

In the difference white is none and darker is more (their Figs. 9 and 11): the mean over the channels of what differs
on the curve of sRGB, and black is the largest of the whole figure, which the title names. The number is the ratio of
peak signal to noise of `render.psnr`.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InvalidValueError
from ..render import Image, psnr
from ..render.image import encoded, srgb
from ._figure import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_WIDTH, _TITLE = 2.1, 0.42  # of a panel and of its title, inches


def differences(
    pairs: Mapping[str, tuple[Image, Image]], title: str = "Images and their differences", columns: int | None = None
) -> "Figure":
    """The figure of (image, reference) by their titles, which have one size; up to four stand in a row.

    Raises InvalidValueError for no pair, and where sizes differ.
    """
    sizes = {image.pixels.shape for pair in pairs.values() for image in pair}
    if len(sizes) != 1:
        raise InvalidValueError(
            f"Expected images of one size, got {sorted(tuple(size[:2]) for size in sizes)}. Render them alike.",
            field="pairs",
        )
    ((height, width, _),) = sizes
    columns = columns or min(4, len(pairs))
    blocks = -(-len(pairs) // columns)
    panel = _WIDTH * height / width
    figure = new_figure(_WIDTH * columns + 0.1, blocks * (2 * panel + _TITLE) + 0.4)
    figure.set_layout_engine("constrained", h_pad=0.02, w_pad=0.02)
    off = {name: _difference(*pair) for name, pair in pairs.items()}
    largest = max(float(values.max()) for values in off.values()) or 1.0
    figure.suptitle(f"{title} (black: {largest:.2g} of white)", fontsize=10)
    axes = figure.subplots(2 * blocks, columns, squeeze=False)
    for place in axes.flat:
        place.set_axis_off()
    for number, (name, (image, reference)) in enumerate(pairs.items()):
        above, below = axes[2 * (number // columns) : 2 * (number // columns) + 2, number % columns]
        above.imshow(encoded(image.pixels.detach().cpu(), reference.plan.scene.exposure).numpy())
        ratio = psnr(image, reference)
        above.set_title(f"{name}\n{'exact' if ratio > 150 else f'{ratio:.1f} dB'}", fontsize=8)
        below.imshow(1 - off[name] / largest, cmap="gray", vmin=0, vmax=1)
    return figure


def _difference(image: Image, reference: Image) -> "np.ndarray":
    exposure = reference.plan.scene.exposure
    a, b = (srgb(one.pixels.detach().cpu(), exposure) for one in (image, reference))
    found: np.ndarray = (a - b).abs().mean(-1).numpy()
    return found
