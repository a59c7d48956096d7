"""Errors of several models at the same samples: a panel a loss, a line a model, the best by the minimised loss on top.

A dot stands at the model's error, on a log axis as in Kurt et al. 2010 Figs. 6 and 8, and a line joins it to the
lowest of its panel, so that its length is the factor that the model loses; the number beside it is that factor. Each
panel's best model is filled, the rest is hollow. An error of exactly 0 cannot stand on a log axis and is drawn at the
panel's left end.
"""

import math
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ..fitting.comparison import Comparison, check_losses
from ..fitting.losses import LOSSES
from ._figure import COLOURS, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PANEL = 1.75  # inches
_LINE = 0.24  # inches a model
_LETTER = 0.072  # inches of a letter of a model's text
_WIDEST = 46  # letters of a line of a model's text
_UNITS = {"cosine": "cosine", "l2": "L2", "log": "log", "cube_root": "cube root", "relative": "relative"}


def comparison(result: Comparison, losses: Sequence[str] | None = None, title: str | None = None) -> "Figure":
    """The figure of a comparison's errors under all losses, or those that are named."""
    shown = list(losses or LOSSES)
    check_losses(shown)
    names = [textwrap.fill(model, _WIDEST) for model in result.models]
    lines = sum(name.count("\n") + 1 for name in names)
    margin = _LETTER * max(len(line) for name in names for line in name.split("\n"))
    figure = new_figure(margin + _PANEL * len(shown) + 0.3, _LINE * lines + 1.25)
    figure.set_layout_engine("constrained", h_pad=0.05, w_pad=0.04)
    samples = result.best.samples
    figure.suptitle(title or f"Errors of {len(names)} models at {len(samples)} samples", fontsize=10)
    axes = list(figure.subplots(1, len(shown), sharey=True, squeeze=False).flat)
    rows = range(len(names))
    for place, loss in zip(axes, shown, strict=True):
        _panel(place, list(result.errors(loss).values()))
        place.set_title(f"{_UNITS[loss]}{' (minimised)' * (loss == result.loss and not result.weighed)}", fontsize=8.5)
    axes[0].set_yticks(list(rows), names, fontsize=8)
    axes[0].set_ylim(len(names) - 0.5, -0.5)
    figure.supxlabel("error", fontsize=9)
    return figure


def _factor(x: float) -> str:
    return f"\u00d7{x:.3g}" if x < 1000 else f"\u00d7{x:.0f}"


def _panel(place: Any, errors: list[float]) -> None:
    """Dots at the errors, and the factors by which they exceed the lowest."""
    from matplotlib.ticker import LogLocator, NullFormatter

    positive = [error for error in errors if error > 0 and math.isfinite(error)]
    least, most = (min(positive), max(positive)) if positive else (1.0, 1.0)
    span = max(most / least, 10.0)
    low = least / span**0.08
    place.set_xscale("log")
    place.set_xlim(low, most * (span**0.45 if most / least > 1 else 10.0))
    for row, error in enumerate(errors):
        at = max(error, low) if math.isfinite(error) else most
        best = error == min(errors)
        place.plot([max(least, low), at], [row, row], color="0.75", linewidth=1.0, zorder=1)
        place.plot(
            [at], [row], "o", color=COLOURS[0], markerfacecolor=COLOURS[0] if best else "white", markersize=5, zorder=2
        )
        factor = "" if error <= 0 or not math.isfinite(error) else f"{error:.3g}" if best else _factor(error / least)
        place.annotate(factor, (at, row), (5, 0), textcoords="offset points", va="center", fontsize=7)
    place.xaxis.set_major_locator(LogLocator(numticks=4))
    place.xaxis.set_minor_formatter(NullFormatter())
    place.tick_params(labelsize=7)
    place.tick_params(axis="y", length=0)
    place.grid(axis="x", color="0.9", linewidth=0.6)
    place.set_axisbelow(True)
    for side in ("top", "right", "left"):
        place.spines[side].set_visible(False)
