"""What a directional albedo costs: every method of `bc.albedo`, from narrow to wide lobes and from normal to grazing.

The lobe is `ward_bounded` with rs = 1, for which every method exists. Each method is asked for smaller and smaller
tolerances until it no longer meets them, or takes too long. The error is |albedo / reference - 1|; the reference is the
slope-disc rule at 1e-12, and how far the closed form at 1e-12, which shares nothing with it, differs is in the notes.
"""

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import torch

from ..energy.albedo import METHODS, Albedo
from ..energy.albedo import albedo as directional
from ..errors import BrdfError
from ..models.material import Material, material
from ..plots._panels import Curve, Panel
from ._study import Cell, Chart, Study, two_digits
from ._timing import interleaved

WIDTHS = (0.001, 0.03, 1.0)
ANGLES = (0.0, 75.0, 89.99)
TOLERANCES = tuple(10.0**-k for k in range(1, 11))
GOALS = (1e-3, 1e-6)
_TIGHTEST = 1e-12
_AUTO = "auto"

Row = tuple[Cell, ...]


@dataclass(frozen=True)
class _Point:
    """What a method gave for a tolerance."""

    tolerance: float
    error: float  # the true one
    claimed: float
    met: bool
    seconds: float  # of the first call


def albedo(
    quick: bool = False,
    seed: int = 0,
    *,
    widths: Sequence[float] | None = None,
    angles: Sequence[float] | None = None,
    tolerances: Sequence[float] | None = None,
    limit: float | None = None,
    repeats: int | None = None,
) -> Study:
    """The study of these widths and angles [degrees]; a method that takes longer than `limit` [s] is asked no further.

    The methods that draw have their own seeds, so this one changes nothing.
    """
    widths = widths or WIDTHS
    angles = angles or (ANGLES[::2] if quick else ANGLES)
    tolerances = tolerances or (TOLERANCES[::3] if quick else TOLERANCES)
    limit, repeats = limit or (0.1 if quick else 1.0), repeats or (2 if quick else 3)
    rows: list[Row] = []
    panels, apart, unserved = [], 0.0, set()
    for width in widths:
        lobe = material(f"ward_bounded(isotropic, rs=1, a={width})")
        for angle in angles:
            theta = math.radians(angle)
            reference = _value(_found(lobe, theta, _TIGHTEST, "slope_disc"))
            apart = max(apart, abs(_value(_found(lobe, theta, _TIGHTEST, "closed_form")) / reference - 1))
            points: dict[str, list[_Point]] = {}
            for method in METHODS:
                try:
                    points[method] = _points(lobe, theta, method, reference, tolerances, limit)
                except BrdfError:
                    unserved.add(method)
            tasks = {
                f"{method} {p.tolerance}": partial(_found, lobe, theta, p.tolerance, method)
                for method, some in points.items()
                for p in some
                if p.seconds <= limit
            }
            taken = interleaved(tasks, repeats, warm=True)
            curves = []
            for method, some in points.items():
                seconds = tuple(taken.get(f"{method} {p.tolerance}", p.seconds) for p in some)
                curves.append(Curve(method, seconds, tuple(p.error for p in some)))
                rows.append((width, angle, method, *_reached(some, seconds)))
            panels.append(Panel(f"a = {width:g}, {angle:g} degrees", tuple(curves)))
    return Study(
        name="albedo",
        question="what a directional albedo costs, to which error",
        columns=(
            "width [1]",
            "theta_o [deg]",
            "method",
            *(f"to {goal:g} [s]" for goal in GOALS),
            "smallest error [1]",
            "after [s]",
            "claims hold",
        ),
        rows=tuple(rows),
        charts=(
            Chart(
                "albedo",
                "Directional albedo of ward_bounded: relative error against time",
                tuple(panels),
                "time [s]",
                "relative error of the albedo [1]",
                columns=len(angles),
            ),
        ),
        sentence=_sentence(rows),
        notes=(
            f"Asked for {', '.join(f'{tolerance:g}' for tolerance in tolerances)} until a method does not meet it, or "
            f"takes longer than {limit:g} s.",
            f"The reference is slope_disc at {_TIGHTEST:g}; closed_form differs from it by at most {apart:.1g}.",
            "claims hold: no error was larger than what the method claimed of it.",
            *(f"{method} does not serve this lobe." for method in sorted(unserved)),
        ),
    )


def _found(lobe: Material, theta: float, tolerance: float, method: str) -> Albedo:
    with torch.no_grad():
        return directional(lobe, theta, tolerance=tolerance, method=method)


def _value(found: Albedo) -> float:
    return float(found.values.reshape(-1)[0])


def _points(
    lobe: Material, theta: float, method: str, reference: float, tolerances: Sequence[float], limit: float
) -> list[_Point]:
    """What the method gives for smaller and smaller tolerances."""
    points = []
    for tolerance in tolerances:
        found = _found(lobe, theta, tolerance, method)
        error = abs(_value(found) / reference - 1)
        points.append(_Point(tolerance, error, float(found.error.max()) / reference, found.met, found.seconds))
        if not found.met or found.seconds > limit:
            break
    return points


def _reached(points: Sequence[_Point], seconds: Sequence[float]) -> tuple[Cell, ...]:
    """The soonest time to each goal, the smallest error and its time, and whether the claims hold."""
    times: list[Cell] = []
    for goal in GOALS:
        enough = [s for p, s in zip(points, seconds, strict=True) if p.error <= goal]
        times.append(min(enough) if enough else None)
    best = min(range(len(points)), key=lambda k: points[k].error)
    rounding = 4e-15  # of the albedo, which the reference itself has
    hold = all(p.error <= p.claimed + rounding for p in points)
    return (*times, points[best].error, seconds[best], hold)


def _sentence(rows: Sequence[Row]) -> str:
    """How auto does, what the other methods cost beside it, and whose claims to doubt."""
    goal = GOALS[-1]
    cases = list(dict.fromkeys(row[:2] for row in rows))
    times = {(str(row[2]), row[:2]): row[4] for row in rows}
    own = {case: times[(_AUTO, case)] for case in cases}
    done = [float(seconds) for seconds in own.values() if seconds is not None]
    sentence = f"Leave the method to auto: it is within {goal:g} in {len(done)} of {len(cases)} cases"
    sentence += f", after at most {max(done):.2g} s" if done else ""
    others, doubtful = [], []
    for method in dict.fromkeys(str(row[2]) for row in rows):
        broken = sum(row[7] is False for row in rows if row[2] == method)
        doubtful += [f"{method} ({broken} of {len(cases)})"] if broken else []
        pairs = [(times[(method, case)], own[case]) for case in cases if (method, case) in times]
        ratios = [float(a) / float(b) for a, b in pairs if a is not None and b is not None]
        text = f"{method} in {sum(a is not None for a, _ in pairs)}"
        others += (
            [text + (f" ({two_digits(statistics.median(ratios))}x the time)" if ratios else "")]
            if method != _AUTO
            else []
        )
    sentence += f"; {', '.join(others)}"
    return f"{sentence}; doubt the claims of {', '.join(doubtful)}." if doubtful else f"{sentence}."
