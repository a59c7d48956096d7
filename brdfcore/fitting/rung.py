"""One step of the ladder of materials that a fit climbed."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Rung:
    """A material that was tried: what it adds or leaves out, how it did, and whether the ladder went on from it.

    error is the root mean square at the samples fitted to, held_out the geometric mean over the incidences of the root
    mean square at each when it was left out (held_out.py), both in the unit of the loss's residual. `criterion` is that
    of the richer of the two materials compared less that of the leaner one [1]: below 0 it asks for the richer one
    (criterion.py); NaN on the first rung.
    """

    effect: str
    model: str
    error: float
    held_out: float
    criterion: float
    parameters: int  # free values, channels counted
    seconds: float
    kept: bool
    reason: str

    def to_dict(self) -> dict[str, Any]:
        """The rung as JSON-able data, null where there is no finite number."""
        numbers = {name: getattr(self, name) for name in ("error", "held_out", "criterion")}
        return {**vars(self), **{name: x if math.isfinite(x) else None for name, x in numbers.items()}}


def table(rungs: Sequence[Mapping[str, Any]]) -> list[str]:
    """The rungs, as `to_dict` makes them, as lines of text; none for none."""
    if not rungs:
        return []
    lines = [f"{'tried':<24}{'error':>10}{'held out':>11}{'criterion':>11}{'values':>8}{'seconds':>9}  stays"]
    for rung in rungs:
        error, held_out, criterion = (_number(rung[name]) for name in ("error", "held_out", "criterion"))
        lines.append(
            f"{rung['effect']:<24}{error:>10}{held_out:>11}{criterion:>11}"
            f"{rung['parameters']:>8}{rung['seconds']:>9.2f}  {'yes' if rung['kept'] else 'no'}"
        )
    return [*lines, ""]


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}"
