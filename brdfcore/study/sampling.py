"""What the samples of each model are worth: the error of an estimated albedo against the time it took.

Every model, with its default values, is sampled in three ways: by its own sampler with random numbers, by its own
sampler with scrambled Sobol points, and by directions in proportion to the cosine, which suit every model a little. The
error is the root mean square, over repetitions, of the mean weight over the true directional albedo, less 1; the albedo
is `bc.albedo`'s. Time is that of drawing and weighing.
"""

import math
import statistics
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import torch
from torch import Tensor

from ..energy.albedo import albedo
from ..geometry import from_angles
from ..models import MODELS
from ..models.material import Material, material
from ..plots._panels import Curve, Panel
from ..sampling import efficiency
from ._study import Cell, Chart, Study, two_digits
from ._timing import interleaved

ANGLES = (60.0, 0.0, 85.0)  # degrees; the first is plotted
OWN, SOBOL, COSINE = "own sampler", "own sampler, Sobol points", "proportional to the cosine"
_EXACT = 1e-10  # an error below that is the rounding of even weights
_EVEN = 1e-12  # variance over albedo^2: less is the rounding of even weights, too
_GOAL = 0.01  # of the albedo, for which the table says the samples

Draw = Callable[[int, int], Tensor]  # (samples, seed) -> uniform numbers (samples, 3)


@dataclass(frozen=True)
class _Way:
    """One way to draw directions for wo: weights (n, C) from uniform numbers (n, 3)."""

    name: str
    draw: Draw
    weights: Callable[[Material, Tensor, Tensor], Tensor]


def sampling(
    quick: bool = False,
    seed: int = 0,
    *,
    models: tuple[str, ...] | None = None,
    angles: tuple[float, ...] | None = None,
    counts: tuple[int, ...] | None = None,
    repetitions: int | None = None,
    repeats: int | None = None,
) -> Study:
    """The study of these models at these angles [degrees], estimating from each of `counts` samples."""
    angles = angles or (ANGLES[:1] if quick else ANGLES)
    repetitions, repeats = repetitions or (8 if quick else 16), repeats or (3 if quick else 5)
    counts = counts or ((64, 1024, 16384) if quick else (64, 1024, 16384, 131072))
    rows: list[tuple[Cell, ...]] = []
    panels: list[Panel] = []
    without_error: list[str] = []
    for angle in angles:
        for name in models or MODELS:
            made = material(name)
            wo = from_angles(torch.tensor(math.radians(angle), dtype=torch.float64), torch.zeros(()).double())
            with torch.no_grad():
                true = float(albedo(made, math.radians(angle), tolerance=1e-8).values)
            curves = [_curve(way, made, wo, true, counts, repetitions, seed, repeats) for way in _WAYS]
            if angle == angles[0]:
                shown = [curve for curve in curves if max(curve.y) > _EXACT]
                panels += [Panel(name, tuple(shown))] if shown else []
                without_error += [] if shown else [name]
            rows.append(_row(name, angle, made, wo, true, curves, counts[-1], seed))
    return Study(
        name="sampling",
        question="how the error of an estimate falls with samples and with time",
        columns=(
            "model",
            "theta_o [deg]",
            "albedo [1]",
            "variance/albedo^2 [1]",
            "lost [1]",
            "samples for 1 %",
            "time a sample [ns]",
            "cosine/own time [1]",
            "random/Sobol error [1]",
        ),
        rows=tuple(rows),
        charts=(
            Chart(
                "sampling",
                f"Albedo at {angles[0]:g} degrees estimated by samples: RMS relative error against time",
                tuple(panels),
                "time [s]",
                "RMS relative error of the albedo [1]",
            ),
        ),
        sentence=_sentence(rows, counts[-1]),
        notes=(
            "Models have their default values; the weights of one wo are drawn in float64.",
            f"{repetitions} repetitions of estimates from {', '.join(map(str, counts))} samples.",
            "cosine/own time: how much longer sampling in proportion to the cosine takes to the same error, by the "
            f"variances; random/Sobol error: with {counts[-1]} samples.",
            "lost: the share of samples below the horizon, whose weight is 0.",
            *(
                f"{name} has even weights, so that its samples have no error; it is not plotted."
                for name in without_error
            ),
        ),
    )


def _random(count: int, seed: int) -> Tensor:
    return torch.rand(count, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(seed))


def _sobol(count: int, seed: int) -> Tensor:
    return torch.quasirandom.SobolEngine(3, scramble=True, seed=seed).draw(count, dtype=torch.float64)


def _own_weights(made: Material, wo: Tensor, u: Tensor) -> Tensor:
    directions = wo.expand(len(u), 3)
    return made.weight(made.sample(directions, u), directions)


def _cosine_weights(made: Material, wo: Tensor, u: Tensor) -> Tensor:
    """Weights f cos theta_i / (cos theta_i / pi) of directions in proportion to the cosine."""
    wi = from_angles(torch.asin(torch.sqrt(u[:, 1])), 2 * torch.pi * u[:, 2])
    return math.pi * made.f(wi, wo.expand(len(u), 3))


_WAYS = (
    _Way(OWN, _random, _own_weights),
    _Way(SOBOL, _sobol, _own_weights),
    _Way(COSINE, _random, _cosine_weights),
)


def _curve(
    way: _Way,
    made: Material,
    wo: Tensor,
    true: float,
    counts: tuple[int, ...],
    repetitions: int,
    seed: int,
    repeats: int,
) -> Curve:
    """Seconds and errors of estimates from each number of samples."""

    def estimate(count: int, at: int) -> float:
        with torch.no_grad():
            return float(way.weights(made, wo, way.draw(count, at)).mean())

    errors = []
    for count in counts:
        off = [estimate(count, seed + 1 + k) / true - 1 for k in range(repetitions)]
        errors.append(math.sqrt(statistics.fmean(x * x for x in off)))
    seconds = interleaved({str(count): partial(estimate, count, seed) for count in counts}, repeats)
    return Curve(way.name, tuple(seconds.values()), tuple(errors))


def _row(
    name: str, angle: float, made: Material, wo: Tensor, true: float, curves: list[Curve], most: int, seed: int
) -> tuple[Cell, ...]:
    """A model's row of the table."""
    own, sobol, cosine = curves
    found = efficiency(made, wo, seed=seed)
    variance = float(found.variance[0]) / true**2
    with torch.no_grad():
        naive = float(_cosine_weights(made, wo, _random(2**16, seed)).var()) / true**2
    each = own.x[-1] / most
    slower = naive * cosine.x[-1] / (variance * own.x[-1]) if variance > _EVEN else None
    better = own.y[-1] / sobol.y[-1] if sobol.y[-1] > _EXACT else None
    samples = max(1, math.ceil(variance / _GOAL**2))
    return (name, angle, true, variance, float(found.lost), samples, 1e9 * each, slower, better)


def _sentence(rows: list[tuple[Cell, ...]], most: int) -> str:
    """What to draw with, and which model is the dearest."""
    slower = {(str(r[0]), float(r[1] or 0)): float(r[7]) for r in rows if isinstance(r[7], float)}
    better = [float(r[8]) for r in rows if isinstance(r[8], float)]
    dearest = max(rows, key=lambda row: float(row[5] or 0))
    gain = two_digits(statistics.median(slower.values()) if slower else 1.0)
    even = two_digits(statistics.median(better) if better else 1.0)
    return (
        f"Draw from a model's own sampler: it reaches the same error in 1/{gain} of the time that "
        f"sampling in proportion to the cosine takes (median of {len(slower)}), and Sobol points cut the error of "
        f"{most} samples to 1/{even} of that of random ones; {dearest[0]} at "
        f"{dearest[1]:g} degrees is the dearest, with {dearest[5]} samples for an error of 1 %."
    )
