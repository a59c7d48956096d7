"""Curves y(x) on plain axes, one panel a case, with one legend."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ._panels import Panel, page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_WIDTH, _HEIGHT = 4.2, 2.9  # of a panel, inches


def curves(panels: Sequence[Panel], title: str, x: str, y: str, *, equal: bool = False) -> "Figure":
    """The figure of the panels' curves; x and y label the axes, with their units.

    With `equal`, x and y have one scale, as the two components of a lobe need it.
    """
    flat = [(p.limits[3] - p.limits[2]) / (p.limits[1] - p.limits[0]) for p in panels if p.limits is not None]
    height = min(0.7 + _WIDTH * max(flat), _HEIGHT) if equal and flat else _HEIGHT
    figure, axes, style = page(panels, title, (_WIDTH, height))
    for place, panel in zip(axes, panels, strict=True):
        place.set_title(panel.title, fontsize=9)
        place.tick_params(labelsize=8)
        place.grid(color="0.88", linewidth=0.6)
        for curve in panel.curves:
            place.plot(curve.x, curve.y, **style[curve.label])
        for label, level in panel.levels:
            place.axhline(level, **style[label])
        if panel.limits is not None:
            place.set_xlim(*panel.limits[:2])
            place.set_ylim(*panel.limits[2:])
        if equal:
            place.set_aspect("equal")
        place.set_xlabel(x, fontsize=9)
    figure.supylabel(y, fontsize=9)
    return figure
