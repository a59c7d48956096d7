"""Accuracy against time: log-log, one panel a case, all panels on the same axes so that they can be compared.

Down is more accurate and left is faster. A curve joins the points of one method, from its cheapest setting to its
dearest; a method without a setting is one marker. A point whose error or time is not positive (an error of exactly 0)
cannot stand on a log axis and is left out.
"""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ._panels import Panel, page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MANY = 9  # panels; more of them are drawn smaller
_SHORT = 100  # an axis from end to end; a shorter one needs labels between the decades
_SIZES = {1: (5.6, 3.4)}  # of a panel in inches, by how many there are


def accuracy(
    panels: Sequence[Panel],
    title: str,
    x: str = "time [s]",
    y: str = "relative error [1]",
    *,
    columns: int | None = None,
) -> "Figure":
    """The log-log figure of the panels' curves; x and y label the axes, with their units."""
    small = len(panels) > _MANY
    if columns is None and small:
        columns = math.ceil(math.sqrt(2 * len(panels)))
    size = (1.9, 1.65) if small else _SIZES.get(len(panels), (3.1, 2.75))
    figure, axes, style = page(panels, title, size, columns=columns)
    for place, panel in zip(axes, panels, strict=True):
        place.set_xscale("log")
        place.set_yscale("log")
        place.set_title(panel.title, fontsize=8.5)
        place.tick_params(labelsize=7.5)
        place.grid(color="0.88", linewidth=0.6)
        place.set_axisbelow(True)
        for curve in panel.curves:
            points = [p for p in zip(curve.x, curve.y, strict=True) if min(p) > 0 and all(map(math.isfinite, p))]
            if points:
                place.plot(*zip(*points, strict=True), **style[curve.label])
        for label, level in panel.levels:
            if level > 0:
                place.axhline(level, **style[label])
    _share(axes, x, (1, 3) if small else (1, 2, 5))
    figure.supylabel(y, fontsize=9)
    return figure


def _share(axes: Sequence[Any], x: str, labels: tuple[int, ...]) -> None:
    """Give all axes the same limits; the outer ones get the labels of the ticks, the lowest the label x."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    for direction in ("x", "y"):
        limits = [getattr(place, f"get_{direction}lim")() for place in axes if place.lines]
        low, high = min(low for low, _ in limits), max(high for _, high in limits)
        for place in axes:
            getattr(place, f"set_{direction}lim")(low, high)
            scale = getattr(place, f"{direction}axis")
            scale.set_minor_formatter(NullFormatter())
            if high / low > _SHORT:
                scale.set_major_locator(LogLocator(numticks=6))
            else:
                scale.set_major_locator(LogLocator(subs=labels, numticks=9))
                scale.set_major_formatter(StrMethodFormatter("{x:g}"))
    for place in axes:
        spec = place.get_subplotspec()
        below = spec.is_last_row()
        place.tick_params(labelbottom=below, which="both")
        place.set_xlabel(x if below else "", fontsize=8.5)
        place.tick_params(labelleft=spec.is_first_col(), which="both")
