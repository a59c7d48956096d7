"""The error that each optimizer reaches against time, from 222 samples to a MERL file's 1.1 million.

The loss is the cosine one, sum w (c f - c y)^2, and the error is how far it lies above its minimum, (loss - minimum) /
minimum; the minimum is the lowest that any of the runs found. The library's optimizers and the peers run on all samples
from the same random starts within the search ranges; `bc.fit` is the whole fit, with a scan that finds its own starts,
and intervals. A curve is the best loss so far against the time since the first start.
"""

import math
import statistics
import time
from collections.abc import Callable

import numpy as np
from torch import Tensor

from ..fitting import fit
from ..fitting.adam import adam
from ..fitting.data import root_weights
from ..fitting.lbfgs import lbfgs
from ..fitting.least_squares import least_squares
from ..fitting.levenberg_marquardt import OnStep, Outcome
from ..fitting.losses import LOSSES
from ..fitting.problem import Problem
from ..fitting.projection import Projection
from ..fitting.variable_projection import variable_projection
from ..plots._panels import Curve, Panel
from ._fit_cases import LINOLEUM, NOISE, TRUE, Case, case, start
from ._peers import PEERS, Minimise, Residuals
from ._study import Cell, Chart, Study, installed

MERL = 1_100_000  # about what a MERL file holds of valid bins
SIZES = (LINOLEUM, 10_000, 100_000, MERL)
REACHED = 1e-6  # of the minimum: far below what noise leaves to tell
_RESOLVED = 1e-14  # of the minimum: less is rounding
_WHOLE = "bc.fit (scan and projection)"

Trace = list[tuple[float, float]]  # seconds since the start, lowest loss so far


def _projection(problem: Problem, x: Tensor, on_step: OnStep) -> Outcome:
    """Variable projection as an optimizer like the others, its plan included."""
    return variable_projection(Projection(problem), x, on_step=on_step)


_OURS: dict[str, Callable[..., Outcome]] = {
    "variable_projection": _projection,
    "least_squares": least_squares,
    "lbfgs": lbfgs,
    "adam": adam,
}


def fitting(
    quick: bool = False,
    seed: int = 0,
    *,
    sizes: tuple[int, ...] | None = None,
    starts: int | None = None,
    adam_steps: int | None = None,
) -> Study:
    """The study of so many samples each, from `starts` random starts (fewer for more than 10,000 samples)."""
    sizes = sizes or (SIZES[:2] if quick else SIZES)
    starts = starts or (2 if quick else 9)
    peers = {label: run for name, (label, run) in PEERS.items() if installed(name)}
    rows: list[tuple[Cell, ...]] = []
    panels = []
    for size in sizes:
        made = case(size, seed)
        steps = adam_steps or int(np.clip(3e8 / size, 200, 300 if quick else 3000))
        if size == sizes[0]:
            _runs(made, seed, 2, peers)  # untimed: what is loaded and compiled on first use belongs to no method
        taken: dict[str, list[Trace]] = {}
        for number in range(max(1, min(starts, starts * SIZES[1] // size))):
            for name, trace in _runs(made, seed + number, steps, peers).items():
                taken.setdefault(name, []).append(trace)
        minimum = min(loss for traces in taken.values() for trace in traces for _, loss in trace)
        rows += [_row(size, name, traces, minimum) for name, traces in taken.items()]
        curves = tuple(_curve(name, traces[0], minimum, name in peers) for name, traces in taken.items())
        panels.append(Panel(f"{size} samples, {made.problem.size} values", curves))
    absent = [name for name in PEERS if not installed(name)]
    return Study(
        name="fitting",
        question="the error that each optimizer reaches against time",
        columns=("samples", "method", "starts", "within 1e-6", "after [s]", "time in all [s]", "median error [1]"),
        rows=tuple(rows),
        charts=(
            Chart(
                "fitting",
                "Fitting: loss above its minimum against time, from one random start",
                tuple(panels),
                "time [s]",
                "(loss - minimum) / minimum [1]",
            ),
        ),
        sentence=_sentence(rows),
        notes=(
            f"{LINOLEUM} samples are the shipped linoleum; others are drawn from {TRUE} with {100 * NOISE:g} % noise.",
            "Starts are random within the search ranges, the same for all methods but bc.fit, which scans for its own "
            "and also computes intervals. Peers compute NumPy residuals and finite differences.",
            "within 1e-6: how many of the starts come so near to the lowest loss of all; times are medians.",
            f"Errors below {_RESOLVED:g} are rounding. Adam lowers its step size to 0 over the steps that it is given.",
            *(f"{name} is not installed, so it is not compared." for name in absent),
        ),
    )


def _runs(made: Case, seed: int, adam_steps: int, peers: dict[str, Minimise]) -> dict[str, Trace]:
    """The trace of every method from the start of this seed, one after the other."""
    at = start(made.problem, seed)
    more: dict[str, dict[str, int]] = {"adam": {"max_iterations": adam_steps}}
    found = {name: _ours(made, run, at, more.get(name, {})) for name, run in _OURS.items()}
    found |= {label: _peer(made, run, at) for label, run in peers.items()}
    return found | {_WHOLE: _whole(made, seed)}


def _row(size: int, name: str, traces: list[Trace], minimum: float) -> tuple[Cell, ...]:
    """A method's row of the table."""
    reached = [next((t for t, loss in trace if loss <= (1 + REACHED) * minimum), None) for trace in traces]
    times = [seconds for seconds in reached if seconds is not None]
    error = statistics.median(trace[-1][1] for trace in traces) / minimum - 1
    first = statistics.median(times) if times else None
    return (size, name, len(traces), len(times), first, statistics.median(t[-1][0] for t in traces), max(error, 0.0))


def _curve(name: str, trace: Trace, minimum: float, hollow: bool) -> Curve:
    """A trace as the plot shows it."""
    seconds = tuple(t for t, _ in trace)
    return Curve(name, seconds, tuple(max(loss / minimum - 1, _RESOLVED) for _, loss in trace), hollow=hollow)


def _ours(made: Case, run: Callable[..., Outcome], at: Tensor, more: dict[str, int]) -> Trace:
    """The trace of one of the library's optimizers."""
    begun = time.perf_counter()
    first = float(made.problem.loss(at.unsqueeze(0))[0])
    trace = [(time.perf_counter() - begun, first)]

    def seen(_: int, loss: float) -> None:
        trace.append((time.perf_counter() - begun, loss))

    outcome = run(made.problem, at.unsqueeze(0), on_step=seen, **more)
    return _lowest([*trace, (time.perf_counter() - begun, float(outcome.loss[0]))])


def _peer(made: Case, run: Minimise, at: Tensor) -> Trace:
    """The trace of a peer."""
    samples, problem = made.samples, made.problem
    weight = root_weights(samples, LOSSES["cosine"]).expand_as(samples.values)[:, 0]
    residuals = Residuals(*(t.numpy() for t in (samples.wi, samples.wo, samples.values[:, 0], weight)))
    natural = np.array([float(problem.unpack(at)[key]) for key in problem.keys])
    trace: Trace = []
    begun = time.perf_counter()
    run(residuals, natural, lambda loss: trace.append((time.perf_counter() - begun, loss)))
    return _lowest([*trace, (time.perf_counter() - begun, trace[-1][1])])


def _whole(made: Case, seed: int) -> Trace:
    """The one point of a whole fit, from nothing to a result with intervals."""
    begun = time.perf_counter()
    found = fit(made.samples, made.model, seed=seed)
    seconds = time.perf_counter() - begun
    values = {key: value.detach() for key, value in found.material.values().items()}
    return [(seconds, float(made.problem.loss(made.problem.pack(values).unsqueeze(0))[0]))]


def _lowest(trace: Trace) -> Trace:
    """The trace with the lowest loss so far, its end, and of what lies between only what gains."""
    best, kept = math.inf, []
    for seconds, loss in trace[:-1]:
        if loss < best:
            kept.append((seconds, loss))
            best = loss
    return [*kept, (trace[-1][0], min(best, trace[-1][1]))]


def _sentence(rows: list[tuple[Cell, ...]]) -> str:
    """Which of the library's ways reaches the minimum soonest, and most surely, for the smallest and largest data."""
    parts = []
    sizes = sorted({int(row[0] or 0) for row in rows})
    for size in dict.fromkeys((sizes[0], sizes[-1])):
        found = {str(name): (int(hits or 0), first) for n, name, _, hits, first, _, _ in rows if n == size}
        starts = next(row[2] for row in rows if row[0] == size)
        ours = {name: hits for name, (hits, _) in found.items() if name in (*_OURS, _WHOLE)}
        best = min(ours, key=lambda name: (-ours[name], float(found[name][1] or math.inf)))
        hits, first = found.pop(best)
        if first is None:
            parts.append(f"at {size} samples none of the library's methods comes within {REACHED:g} of the minimum")
            continue
        others = [
            f"{name} {number}" + (f" in {float(seconds) / float(first):.2g}x the time" if seconds is not None else "")
            for name, (number, seconds) in found.items()
        ]
        parts.append(
            f"at {size} samples take {best}, within {REACHED:g} of the minimum from {hits} of {starts} starts after "
            f"{float(first):.2g} s ({', '.join(others)})"
        )
    text = "; ".join(parts)
    return f"{text[0].upper()}{text[1:]}."
