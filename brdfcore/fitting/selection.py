"""Which of several materials the data call for: what `bc.fit` does for model="auto" or a list of texts.

A richer material stays only if incidences that were left out are foretold better, in the geometric mean of their errors
(held_out.py), and the information criterion falls, which takes no misfit for noise (criterion.py). "auto" climbs from
Lambert's term: each effect that is not there yet is tried in turn, again and again until none is called for, at last
all that are left at once, for two crossed lobes show only together, and a lobe may only with its Fresnel factor; then
each is left out in turn, the diffuse term too (effects.py). A list is walked in the order of its numbers of free
values. All rungs see the same samples and the same folds, and each starts from where the last one that stayed ended,
beside its own scan.
"""

import functools
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import torch
from torch import Tensor

from ..formats.samples import Samples
from ..models.form import Form
from ._fit import Progress, Teller, check_samples, fit, planned
from .asked import check, form_of, own, texts
from .criterion import Spread, gain, spread
from .effects import AUTO, FAMILIES, PARTS, STEPS, Effects
from .folds import split
from .held_out import left_out, typical
from .result import Fit
from .rung import Rung
from .search import search

FOLDS = 5
_ROUNDING = 1e-6  # of a black material's error, of an error, or of the criterion: as good as nothing
_CLIMB = 20_000  # samples on which materials are told apart; the chosen one is fitted to all


@dataclass(frozen=True)
class _Tried:
    """A material's optimum on the samples that the ladder climbs on."""

    model: str
    values: dict[str, Tensor]
    parameters: int
    spread: Spread
    error: float
    held_out: float
    seconds: float

    def numbers(self) -> dict[str, float | list[float]]:
        """The values as `starts` takes them."""
        return {key: value.tolist() for key, value in self.values.items()}


class _Ladder:
    """The rungs so far, and what each needs."""

    def __init__(self, samples: Samples, say: Teller, keywords: dict[str, Any]) -> None:
        seed = keywords["seed"]
        if len(samples) > _CLIMB:
            chosen = torch.randperm(len(samples), generator=torch.Generator().manual_seed(seed))[:_CLIMB]
            samples = samples.subset(chosen.sort().values)
        self.samples, self.seed, self.say, self.keywords = samples, seed, say, keywords
        self.parts: tuple[Tensor, Tensor] | None = None  # the block and the fold of each sample
        self.rungs: list[Rung] = []
        self.known: dict[str, _Tried] = {}

    def form(self, model: str) -> Form:
        """The form of a material's text."""
        return form_of(model, azimuth_observed=self.samples.azimuth_observed)

    def own(self, model: str) -> dict[str, Any]:
        """The keywords that concern a material."""
        return own(self.keywords, self.form(model))

    def tried(self, model: str, near: Mapping[str, Any]) -> _Tried:
        """The material's optimum, searched once, from these values too, and its errors."""
        if model in self.known:
            return self.known[model]
        begun = time.perf_counter()
        keywords = self.own(model)
        if near:
            keywords["starts"] += own({"starts": [near]}, self.form(model))["starts"]
        made, (kept,) = planned([self.samples], model, **keywords)
        found = search(made, [kept], self.keywords["loss"], self.keywords.get("optimizer", "auto"), self.seed, _silent)
        self.parts = self.parts or split(kept, FOLDS, self.seed)
        block, fold = self.parts
        x, problem = found.outcome.x, found.problem
        squares, weights = left_out(problem, x, fold)
        total = float(weights.sum()) or 1.0
        black = problem.residuals(torch.zeros_like(problem.data.y), problem.data, None)[0].sum()
        one = _Tried(
            model,
            problem.unpack(x[0]),
            problem.size,
            spread(problem, x),
            math.sqrt(float(found.outcome.loss[0]) / total),
            typical(squares, weights, block, _ROUNDING * math.sqrt(float(black) / total)),
            time.perf_counter() - begun,
        )
        self.known[model] = one
        self.say("ladder", 1 - 0.85 ** len(self.known), float(found.outcome.loss[0]))
        return one

    def first(self, effect: str, model: str) -> _Tried:
        """The material that the ladder stands on."""
        one = self.tried(model, {})
        self.note(effect, one, math.nan, kept=True, reason="The first of the ladder.")
        return one

    def note(self, effect: str, one: _Tried, criterion: float, *, kept: bool, reason: str) -> None:
        """Put a rung on record."""
        rung = Rung(effect, one.model, one.error, one.held_out, criterion, one.parameters, one.seconds, kept, reason)
        self.rungs.append(rung)

    def called_for(self, richer: _Tried, leaner: _Tried) -> tuple[bool, float, str]:
        """Whether the richer material is called for, the criterion's change, and both in a sentence."""
        criterion = gain(richer.spread, leaner.spread)
        foretells = richer.held_out < leaner.held_out * (1 - _ROUNDING)
        change = f"the criterion {'falls' if criterion < 0 else 'rises'} by {abs(criterion):.3g}"
        if math.isinf(criterion):
            change = "there are fewer than two samples a value to judge it by"
        sentence = f"the held-out error {_goes(foretells, leaner.held_out, richer.held_out)} and {change}"
        return foretells and criterion < -_ROUNDING, criterion, sentence


def select(
    samples: Samples,
    model: str | Sequence[str],
    progress: Callable[[Progress], None] | None,
    **keywords: Any,
) -> Fit:
    """The fit of the material that the data call for, its ladder in the result; the keywords are those of `fit`."""
    begun = time.perf_counter()
    check_samples(samples)
    check(samples.values.shape[1], model, azimuth_observed=samples.azimuth_observed, **keywords)
    ladder = _Ladder(samples, Teller(progress, 0.0, 0.8), keywords)
    chosen, ended = _climbed(ladder) if model == AUTO else _listed(ladder, texts(model))
    final = ladder.own(chosen.model)
    final["starts"] = [*final["starts"], chosen.numbers()]
    result = fit(samples, chosen.model, progress=Teller(progress, 0.8, 0.2).relay, **final)
    return replace(
        result,
        plan=replace(result.plan, starts=result.plan.starts[:-1]),  # those that were asked for
        ladder=tuple(ladder.rungs),
        choices=(*result.choices, ended),
        cost=replace(result.cost, seconds=time.perf_counter() - begun),
    )


def _climbed(ladder: _Ladder) -> tuple[_Tried, str]:
    """The material that the climb ends at, and why it ends."""
    effects = Effects()
    current = ladder.first("diffuse", effects.text())
    observed = ladder.samples.azimuth_observed
    effects, current = _settled(ladder, effects, current, observed=observed)
    other, best = _shaped(ladder, effects, current)
    if other != effects:
        effects, current = _settled(ladder, other, best, observed=observed)
    absent = _absent(effects, observed=observed)
    ended = f"The ladder ends at {current.model}: "
    ended += f"the data call for no {_or(absent)}." if absent else "no effect is left to add."
    if effects.lobes and not observed:
        ended += " Anisotropy was not tried, for the sample's azimuth was not observed."
    return current, ended


def _settled(ladder: _Ladder, effects: Effects, current: _Tried, *, observed: bool) -> tuple[Effects, _Tried]:
    """Effects added and left out until nothing changes."""
    been = {effects}
    while True:
        effects, current = _richer(ladder, effects, current, observed=observed)
        leaner, current = _leaner(ladder, effects, current)
        if leaner == effects or leaner in been:
            return leaner, current
        been.add(leaner)
        effects = leaner


def _shaped(ladder: _Ladder, effects: Effects, current: _Tried) -> tuple[Effects, _Tried]:
    """The same effects with lobes of the family that foretells best."""
    for family in FAMILIES if effects.lobes else ():
        other = effects.of(family)
        if other is None or other.text() in ladder.known:
            continue
        one = ladder.tried(other.text(), {})
        stays, criterion, sentence = ladder.called_for(one, current)
        reason = f"With lobes of {family} {sentence}: {_verdict(stays)}."
        ladder.note(f"{family}'s shape", one, criterion, kept=stays, reason=reason)
        if stays:
            effects, current = other, one
    return effects, current


def _absent(effects: Effects, *, observed: bool) -> list[str]:
    """What could be added."""
    return [effect for effect in STEPS if effects.plus(effect) and (observed or effect != "anisotropy")]


def _richer(ladder: _Ladder, effects: Effects, current: _Tried, *, observed: bool) -> tuple[Effects, _Tried]:
    """Effects added until a round of all adds none, nor all that are left at once."""
    while True:
        effects, current = _one_by_one(ladder, effects, current, observed=observed)
        left = _absent(replace(effects, lobes=max(1, effects.lobes)), observed=observed)
        if not effects.lobes:
            left = ["lobe", *(effect for effect in left if effect != "second lobe")]
        richer = functools.reduce(lambda some, effect: some.plus(effect) or some, left, effects)
        if len(left) < 2 or richer.text() in ladder.known:
            return effects, current
        one = ladder.tried(richer.text(), richer.near(current.numbers()))
        stays, criterion, sentence = ladder.called_for(one, current)
        ladder.note(" + ".join(left), one, criterion, kept=stays, reason=f"With all {sentence}: {_verdict(stays)}.")
        if not stays:
            return effects, current
        effects, current = richer, one


def _one_by_one(ladder: _Ladder, effects: Effects, current: _Tried, *, observed: bool) -> tuple[Effects, _Tried]:
    """Effects added one at a time until a round of all adds none."""
    grown = True
    while grown:
        grown = False
        for effect in _absent(effects, observed=observed):
            richer = effects.plus(effect)
            if richer is None or richer.text() in ladder.known:
                continue
            one = ladder.tried(richer.text(), richer.near(current.numbers()))
            stays, criterion, sentence = ladder.called_for(one, current)
            ladder.note(effect, one, criterion, kept=stays, reason=f"With it {sentence}: {_verdict(stays)}.")
            if stays:
                effects, current, grown = richer, one, True
    return effects, current


def _leaner(ladder: _Ladder, effects: Effects, current: _Tried) -> tuple[Effects, _Tried]:
    """Effects left out until each that is there is called for."""
    shrunk = True
    while shrunk:
        shrunk = False
        for effect in PARTS:
            leaner = effects.minus(effect)
            if leaner is None:
                continue
            new = leaner.text() not in ladder.known
            one = ladder.tried(leaner.text(), leaner.near(current.numbers()))
            stays, criterion, sentence = ladder.called_for(current, one)
            if new or not stays:
                reason = f"With {effect} {sentence}: {_verdict(stays)}."
                ladder.note(f"without {effect}", one, criterion, kept=not stays, reason=reason)
            if not stays:
                effects, current, shrunk = leaner, one, True
    return effects, current


def _listed(ladder: _Ladder, several: Sequence[str]) -> tuple[_Tried, str]:
    """The best of the texts by the same rule, and why it is."""
    order = sorted(several, key=lambda text: len(ladder.form(text).parameters))
    current = ladder.first(order[0], order[0])
    for text in order[1:]:
        one = ladder.tried(text, {})
        stays, criterion, sentence = ladder.called_for(one, current)
        ladder.note(text, one, criterion, kept=stays, reason=f"Against {current.model} {sentence}: {_verdict(stays)}.")
        current = one if stays else current
    return current, f"Of {len(several)} models the data call for {current.model}."


def _silent(stage: str, fraction: float, loss: float) -> None:
    """Progress is told a material at a time."""


def _goes(falls: bool, before: float, after: float) -> str:
    return f"{'falls' if falls else 'does not fall'} ({before:.4g} to {after:.4g})"


def _verdict(stays: bool) -> str:
    return "it stays" if stays else "it is left out"


def _or(names: Sequence[str]) -> str:
    return " or ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
