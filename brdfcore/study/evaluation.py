"""What one value of a lobe costs, and how many of its digits are right.

Ward's lobe [1/sr] is evaluated by this library (float32 and float64; all directions at once, in chunks that stay in the
processor's cache, and compiled) and in NumPy in the three forms that are in print. The error is the largest relative
error over directions that the lobe itself draws, against 40-digit arithmetic on the directions as they are stored.
What rounding the directions to float32 does to f, whatever evaluates it, is a level of its own in the plot.
"""

import statistics
from collections.abc import Sequence

import numpy as np
import torch

from ..plots._panels import Curve, Panel
from ._study import Cell, Chart, Study, two_digits
from ._textbook import exact, relative_errors
from ._timing import interleaved
from ._ward_methods import (
    APPROXIMATION,
    CHUNK,
    EQ_3,
    EQ_4,
    PRINTED,
    RS,
    STRETCH,
    directions,
    first_calls,
    has_compiler,
    methods,
)

WIDTHS = (0.001, 0.03, 0.5)
_ROUNDED = "rounding the directions to float32"
_SAVES = 0.9  # of the time: more is within the noise of the clock

Row = tuple[Cell, ...]
By = dict[tuple[str, str], float]  # method and type


def evaluation(
    quick: bool = False,
    seed: int = 0,
    *,
    widths: tuple[float, ...] = WIDTHS,
    count: int | None = None,
    checked: int | None = None,
    repeats: int = 5,
) -> Study:
    """The study over `count` directions for each width, `checked` of them compared with the reference."""
    count = count or (2**18 if quick else 2**20)
    checked = min(checked or (400 if quick else 2000), count)
    compiled = not quick and has_compiler()
    rows: list[Row] = []
    panels = []
    roundings: dict[float, float] = {}
    compiling: list[float] = []
    for width in widths:
        wi, wo = directions(width, count, seed)
        ways = methods(width, wi, wo, compiled=compiled)
        compiling += first_calls(ways)
        seconds = interleaved({way.label: way.run for way in ways}, repeats)
        reference = {
            kind: exact(wi[:checked].to(dtype).numpy(), wo[:checked].to(dtype).numpy(), RS, width, STRETCH * width)
            for kind, dtype in (("float64", torch.float64), ("float32", torch.float32))
        }
        pairs = zip(reference["float32"], reference["float64"], strict=True)
        roundings[width] = float(max(abs(single / double - 1) for single, double in pairs))
        base = seconds[f"{EQ_3}, float64"]
        curves = []
        for way in ways:
            errors = relative_errors(way.values(checked), reference[way.kind])
            largest, median = float(errors.max()), float(np.median(errors))
            each = 1e9 * seconds[way.label] / count
            rows.append((width, way.name, way.kind, each, seconds[way.label] / base, largest, median))
            curves.append(Curve(way.label, (each,), (largest,), way.name, way.kind == "float32"))
        panels.append(
            Panel(f"ax = {width:g}, ay = {STRETCH * width:g}", tuple(curves), ((_ROUNDED, roundings[width]),))
        )
    return Study(
        name="evaluation",
        question="what a value of Ward's lobe costs, and how many of its digits are right",
        columns=(
            "width [1]",
            "method",
            "type",
            "time [ns]",
            "time/textbook [1]",
            "largest rel. error [1]",
            "median rel. error [1]",
        ),
        rows=tuple(rows),
        charts=(
            Chart(
                "evaluation",
                "Evaluating Ward's lobe: largest relative error against the time a direction",
                tuple(panels),
                "time a direction [ns]",
                "largest relative error of f [1]",
            ),
        ),
        sentence=_sentence(rows, *min(roundings.items())),
        notes=(
            f"{count} directions a width, drawn by the lobe for even cosines of wo; {checked} of them are checked.",
            f"Chunks are of {CHUNK} directions. The library computes the half vector of float32 directions in float64.",
            "The library's values are 0 below the horizon, do not overflow at it and have derivatives; those in print "
            "are not checked for any of it.",
            _printed_forms(rows),
            *(
                f"At ax = {width:g}, rounding the directions to float32 alone changes f by up to {rounding:.2g}."
                for width, rounding in roundings.items()
            ),
            _about_compiling(compiling, quick),
        ),
    )


def _about_compiling(seconds: Sequence[float], quick: bool) -> str:
    if seconds:
        return (
            "Compiling, anew for every type and number of directions, took "
            f"from {min(seconds):.2g} to {max(seconds):.2g} s; what is compiled is kept on disk."
        )
    return "Not compiled, as --quick asks." if quick else "Not compiled: this machine has no C++ compiler."


def _summary(rows: Sequence[Row]) -> tuple[By, By]:
    """The largest error over the widths and the mean time [ns] of each method and type."""
    worst: By = {}
    times: dict[tuple[str, str], list[float]] = {}
    for _, name, kind, each, _, error, _ in rows:
        key = (str(name), str(kind))
        worst[key] = max(worst.get(key, 0.0), float(error or 0.0))
        times.setdefault(key, []).append(float(each or 0.0))
    return worst, {key: statistics.fmean(each) for key, each in times.items()}


def _sentence(rows: Sequence[Row], narrowest: float, rounding: float) -> str:
    """What to use of this library, and what float32 would change."""
    worst, mean = _summary(rows)
    fast, fine = (
        min((key for key in mean if key[0] not in PRINTED and key[1] == kind), key=lambda key: mean[key])
        for kind in ("float32", "float64")
    )
    ratio = mean[fast] / mean[fine]
    change = f"costs {ratio:.2g}x of that" if ratio < _SAVES else "saves no time, only memory"
    return (
        f"Take {_spoken(fine)} (relative error {worst[fine]:.1g}, {mean[fine] / mean[(EQ_3, 'float64')]:.2g}x the "
        f"textbook's time): {_spoken(fast)} {change}, is good to {worst[fast]:.1g}, and needs directions whose own "
        f"rounding to float32 changes f by up to {rounding:.1g} at width {narrowest:g}."
    )


def _spoken(key: tuple[str, str]) -> str:
    return f"{key[1]} {key[0].removeprefix('brdfcore, ')}"


def _printed_forms(rows: Sequence[Row]) -> str:
    """What the forms in print lose, and what they cost beside each other."""
    worst, mean = _summary(rows)
    angles, vector, approximation = ((name, "float64") for name in (EQ_3, EQ_4, APPROXIMATION))
    return (
        f"The textbook's angles (Walter eq. 3) lose up to {worst[angles]:.1g} in float64 and "
        f"{worst[(EQ_3, 'float32')]:.1g} in float32; his eq. 4 is exact to {worst[vector]:.1g} and takes "
        f"{mean[vector] / mean[angles]:.2g}x the time of eq. 3; Ward's approximation is off by up to "
        f"{two_digits(worst[approximation])} and takes {mean[approximation] / mean[vector]:.2g}x the time of eq. 4."
    )
