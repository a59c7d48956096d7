"""What accuracy costs in time: studies that anyone can run again on their own machine.

`STUDIES` are functions of (quick, seed), one a file; `run` makes one with one thread and says what made it.
"""

import dataclasses
import time
from collections.abc import Sequence
from datetime import UTC, datetime

from ..errors import InvalidValueError, unknown_name
from . import albedo, effects, evaluation, fitting, papers, render, sampling
from ._study import Chart, MakeStudy, Study, machine, versions
from ._timing import THREADS, one_thread

__all__ = ["ASKED_FOR", "STUDIES", "Chart", "Study", "check", "run"]

STUDIES: dict[str, MakeStudy] = {
    "albedo": albedo.albedo,
    "evaluation": evaluation.evaluation,
    "fitting": fitting.fitting,
    "sampling": sampling.sampling,
    "effects": effects.effects,
    "render": render.render,
    "papers": papers.papers,
}
_SEEDS = 2**31  # what every generator here takes, with room to count on from it
ASKED_FOR = ("papers",)  # only by name: their plots are the papers', not accuracy against time


def check(names: Sequence[str], seed: int = 0) -> tuple[str, ...]:
    """The studies of these names, each once; all but those of `ASKED_FOR` where no name is given.

    Raises UnknownNameError for a name that is none, and InvalidValueError for a seed that is no whole number from 0.
    """
    for name in names:
        if name not in STUDIES:
            raise unknown_name("a study", name, STUDIES, field="names")
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed < _SEEDS:
        raise InvalidValueError(
            f"Expected seed to be a whole number from 0 to 2^31 - 1, got {seed!r}. Choose another.", field="seed"
        )
    return tuple(dict.fromkeys(names)) or tuple(name for name in STUDIES if name not in ASKED_FOR)


def run(name: str, quick: bool = False, seed: int = 0) -> Study:
    """The study of that name with what made it; raises what `check` raises."""
    check([name], seed)
    begun = time.perf_counter()
    with one_thread():
        study = STUDIES[name](quick=quick, seed=seed)
    provenance = {
        "machine": machine(),
        "versions": versions(),
        "threads": THREADS,
        "seed": seed,
        "quick": quick,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "seconds": time.perf_counter() - begun,
    }
    return dataclasses.replace(study, provenance=provenance)
