"""`bc.fit_batch`: fits of one model to many materials, those that were measured at the same directions at once."""

import time
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from typing import Any

from ..errors import SamplesError
from ..formats.samples import Samples
from ._fit import Teller, planned
from .conservation import conserving
from .given import plainly
from .result import Fit
from .search import search
from .worth import fits

_AT_ONCE = 4_000_000  # values of all materials that are fitted at once


def fit_batch(several: Iterable[Samples], model: str, **keywords: Any) -> list[Fit]:
    """The fits of one model to each of the samples, in their order; the keywords are those of `fit`.

    Materials measured at the same directions are fitted as one batch: they share the scan, and each of its starts is a
    row beside the others. The rest are fitted one directions' set after the other. Each fit equals that of `fit` alone
    to rounding; its cost is its share of the batch's. Everything that can be refused is refused before any work.
    """
    every = _listed(several)
    progress = keywords.pop("progress", None)
    keywords = plainly(keywords)
    sets: dict[object, list[int]] = {}
    for i, samples in enumerate(every):
        sets.setdefault(_alike(samples), []).append(i)
    work = [(rows, *planned([every[i] for i in rows], model, **keywords)) for rows in sets.values()]
    found: dict[int, Fit] = {}
    done = 0
    for rows, plan, kept in work:
        step = max(1, _AT_ONCE // kept[0].values.numel())
        for begin in range(0, len(rows), step):
            clock = time.perf_counter()
            here, several_ = rows[begin : begin + step], kept[begin : begin + step]
            say = Teller(progress, done / len(every), len(here) / len(every))
            seed = keywords.get("seed", 0)
            loss, optimizer = keywords.get("loss", "cosine"), keywords.get("optimizer", "auto")
            ends = search(plan, several_, loss, optimizer, seed, say)
            say("uncertainty", 0.95, float(ends.outcome.loss.min()))
            cost = partial(ends.cost, clock, len(here))
            made = fits(ends.problem, ends.outcome, several_, [every[i] for i in here], seed, cost)
            if plan.conserve_energy:
                alone = zip(made, several_, here, strict=True)
                made = [
                    conserving(one, ends.of_material(row), kept, every[i], optimizer, say)
                    for row, (one, kept, i) in enumerate(alone)
                ]
                seconds = cost().seconds
                made = [replace(one, cost=replace(one.cost, seconds=seconds)) for one in made]
            found.update(zip(here, made, strict=True))
            done += len(here)
            say("done", 1.0, float(ends.outcome.loss.min()))
    return [found[i] for i in range(len(every))]


def _listed(several: object) -> list[Samples]:
    """The samples one by one; raises where there is no list of them."""
    if isinstance(several, Samples) or not isinstance(several, Iterable):
        raise SamplesError(
            f"Expected samples to be a list of Samples, got {type(several).__name__}. Pass a list, or use bc.fit for "
            "one material.",
            field="samples",
        )
    return list(several)


def _alike(samples: Samples) -> object:
    """What samples that can be fitted in one batch have in common."""
    if not isinstance(samples, Samples):
        raise SamplesError(
            f"Expected samples to be a list of Samples, got {type(samples).__name__} in it. Make them with bc.read or "
            "bc.Samples.",
            field="samples",
        )
    directions = tuple(hash(each.numpy().tobytes()) for each in (samples.wi, samples.wo))
    known = samples.sigma is not None
    weighs = known and samples.weight is None  # sigma does, where no weight takes its place
    return *directions, samples.values.shape, samples.channels, samples.azimuth_observed, known, weighs
