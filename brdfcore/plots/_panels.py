"""What plots of many curves share: their data, small multiples on one page, and one legend below them.

A curve's hue decides its colour and its marker, so that colour is never the only cue; curves of one hue are told apart
by a filled or a hollow marker and by the line. Every label has one style in all panels.
"""

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ._figure import COLOURS, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MARKERS = "osD^vPX"
_LINES = ("-", "--", "-.", ":")
_TITLE_WIDTH = 12.5  # letters of the title in an inch


@dataclass(frozen=True)
class Curve:
    """Points x, y under a label; `hue` is shared by curves of one colour (its own label by default)."""

    label: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    hue: str | None = None
    hollow: bool = False
    marked: bool = True


@dataclass(frozen=True)
class Panel:
    """The curves of one case, levels (label, y) that are drawn across it, and the ends of the axes if they are set."""

    title: str
    curves: tuple[Curve, ...]
    levels: tuple[tuple[str, float], ...] = ()
    limits: tuple[float, float, float, float] | None = None  # of x and of y; plain axes only


def styles(panels: Sequence[Panel]) -> dict[str, dict[str, Any]]:
    """How each label is drawn, matplotlib's line properties, in the order in which the labels first appear."""
    curves = {curve.label: curve for panel in panels for curve in panel.curves}
    hues = list(dict.fromkeys(curve.hue or label for label, curve in curves.items()))
    found: dict[str, dict[str, Any]] = {}
    for label, curve in curves.items():
        number = hues.index(curve.hue or label)
        turn = number // len(COLOURS)
        colour = COLOURS[number % len(COLOURS)]
        found[label] = {
            "color": colour,
            "marker": _MARKERS[(number + turn) % len(_MARKERS)] if curve.marked else "",
            "markerfacecolor": "white" if curve.hollow else colour,
            "markersize": 4.5,
            "linestyle": _LINES[(turn + curve.hollow + (0 if curve.marked else number)) % len(_LINES)],
            "linewidth": 1.2,
        }
        if all(len(c.x) < 2 for panel in panels for c in panel.curves if c.label == label):
            found[label]["linestyle"] = ""
    levels = list(dict.fromkeys(label for panel in panels for label, _ in panel.levels))
    for number, label in enumerate(levels):
        found[label] = {"color": "0.35", "linestyle": _LINES[(number + 3) % len(_LINES)], "linewidth": 1.2}
    return found


def page(
    panels: Sequence[Panel], title: str, size: tuple[float, float], *, columns: int | None = None
) -> tuple["Figure", list[Any], dict[str, dict[str, Any]]]:
    """An empty figure with its title and its legend, the axes of each panel, and the style of each label.

    `size` is that of one panel in inches; without `columns`, panels stand up to three in a row.
    """
    from matplotlib.lines import Line2D

    columns = columns or {1: 1, 2: 2, 4: 2}.get(len(panels), 3)
    rows = math.ceil(len(panels) / columns)
    style = styles(panels)
    width = max(size[0] * columns, 4.5)
    wrapped = textwrap.wrap(title, int(_TITLE_WIDTH * width))
    per_row = max(1, int(width / (0.5 + 0.06 * max(len(label) for label in style))))
    legend_rows = math.ceil(len(style) / per_row)
    height = size[1] * rows + 0.2 * len(wrapped) + 0.18 * legend_rows + 0.35
    figure = new_figure(width, height)
    figure.set_layout_engine("constrained", h_pad=0.05, w_pad=0.05)
    figure.suptitle("\n".join(wrapped), fontsize=10)
    handles = [Line2D([], [], label=label, **properties) for label, properties in style.items()]
    figure.legend(handles=handles, loc="outside lower center", ncols=per_row, fontsize=8, frameon=False)
    grid = figure.subplots(rows, columns, squeeze=False)
    axes = list(grid.flat)
    for spare in axes[len(panels) :]:
        spare.remove()
    return figure, axes[: len(panels)], style
