"""The hard cases of a model: hard directions, every end of every parameter's box, and every corner of it.

A model gets them by what it declares, with no entry of its own here: its options, its parameters with their boxes, and
its sampler, which finds the directions where the lobe is.
"""

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import torch

from ..models import Model
from ..models.form import Form, Term
from ..parameters import Parameter
from .directions import PLACES, Direction, Pair, at, opposite
from .reasons import why_an_end_is_hard

Values = tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Point:
    """One evaluation: a model with its options chosen, all its values, and a pair of directions."""

    choice: Model
    values: Values
    wi: Direction
    wo: Direction


@dataclass(frozen=True)
class HardCase:
    """Evaluations that are hard for one reason."""

    name: str
    why: str
    points: tuple[Point, ...]


VIEWERS = (at(0.87), at(0.17, 1.9), at(0.003, 0.7))
NUMBERS = ((0.0, 0.3, 0.15), (0.0, 0.9997, 0.9997))  # u: the middle of a lobe, and its tail


def covering(model: type[Model]) -> list[Model]:
    """The fewest choices of options, found greedily, in which each of the model's words stands at least once."""
    chosen: list[Model] = []
    missing = {word for group in model.option_groups for word in group}
    while missing or not chosen:
        best = max(model.with_words(()), key=lambda choice: len(missing & set(choice.options)))
        chosen.append(best)
        missing -= set(best.options)
    return chosen


def ends(parameter: Parameter) -> tuple[float, float]:
    """The smallest and the largest value of a parameter's box."""
    return parameter.ends(torch.float64)


def corners(choice: Model) -> list[Values]:
    """Every corner of a model's box."""
    names = [p.name for p in choice.parameters]
    return [tuple(zip(names, c, strict=True)) for c in itertools.product(*(ends(p) for p in choice.parameters))]


def defaults(choice: Model, **changed: float) -> Values:
    """The default values, some of them changed."""
    return tuple((p.name, changed.get(p.name, p.default)) for p in choice.parameters)


def form_of(choice: Model) -> Form:
    """A material's structure of this one term."""
    return Form((Term(choice.name, choice),))


def lobe_pairs(choice: Model, values: Values, viewers: Sequence[Direction] = VIEWERS) -> list[Pair]:
    """Pairs whose wi is where the model reflects light to wo: what it samples, where that is above the horizon."""
    tensors = {f"{choice.name}.{name}": torch.tensor(x, dtype=torch.float64) for name, x in values}
    wo = torch.tensor(viewers, dtype=torch.float64)[:, None]
    drawn = form_of(choice).sample(tensors, wo, torch.tensor(NUMBERS, dtype=torch.float64))
    found: list[Pair] = []
    for viewer, directions in zip(viewers, drawn.tolist(), strict=True):
        found += [((x, y, z), viewer) for x, y, z in directions if z > 1e-6]
    return found or [(at(0.8), at(0.6, 3.0))]


def _points(choice: Model, values: Values, pairs: Iterable[Pair]) -> tuple[Point, ...]:
    return tuple(Point(choice, values, wi, wo) for wi, wo in pairs)


def _in_lobe(choice: Model, *sets: Values) -> tuple[Point, ...]:
    return tuple(point for values in sets for point in _points(choice, values, lobe_pairs(choice, values)))


def _at_ends(choice: Model, p: Parameter) -> Iterator[HardCase]:
    for end, x in zip(("low", "high"), ends(p), strict=True):
        name, points = f"{p.name} = {x:.5g}", _in_lobe(choice, defaults(choice, **{p.name: x}))
        yield HardCase(name, why_an_end_is_hard(p, end, name), points)


def _side_by_side(choice: Model) -> Iterator[HardCase]:
    """Widths or exponents at opposite ends along x and y."""
    for p, q in itertools.pairwise(choice.parameters):
        if p.scale == q.scale == "log" and (p.low, p.high) == (q.low, q.high):
            low, high = ends(p)
            wide = min(1.0, high) if low < 1 else high
            sets = (defaults(choice, **{p.name: x, q.name: y}) for x, y in ((low, wide), (wide, low)))
            name = f"{p.name} : {q.name} = {low:.5g} : {wide:.5g}, and reversed"
            yield HardCase(name, "the azimuth of h decides between 0 and the peak", _in_lobe(choice, *sets))


def _denormal(choice: Model, p: Parameter) -> HardCase:
    sets = (defaults(choice, **{p.name: x}) for x in (5e-324, 1e-310, 1e-45, 1e-40))
    points = (_points(choice, values, lobe_pairs(choice, values, VIEWERS[:1])) for values in sets)
    return HardCase(f"{p.name} a denormal number", "what divides by it overflows", tuple(itertools.chain(*points)))


def _corners(choice: Model) -> HardCase:
    points = (
        _points(choice, values, [*lobe_pairs(choice, values, VIEWERS[:1])[:1], opposite(1e-4, 0.6)])
        for values in corners(choice)
    )
    return HardCase("every corner of the box", "two extremes at once", tuple(itertools.chain(*points)))


def catalogue(model: type[Model]) -> list[HardCase]:
    """The hard cases of a model over its options, by kind: directions, ends of boxes, pairs of ends, corners.

    Each choice of `covering` sees every kind of directions, the first one every pair of them; the ends of a parameter's
    box are tried in the choice that first declares it, and the corners of every choice's box.
    """
    directions: list[HardCase] = []
    extremes: list[HardCase] = []
    numbers: list[HardCase] = []
    boxes: list[HardCase] = []
    seen: set[Parameter] = set()
    for choice in covering(model):
        step = 3 if directions else 1
        directions += [
            HardCase(place.name, place.why, _points(choice, defaults(choice), place.pairs[::step])) for place in PLACES
        ]
        fresh = [p for p in choice.parameters if p not in seen]
        seen |= set(fresh)
        extremes += [case for p in fresh for case in _at_ends(choice, p)]
        if sum(p.scale == "log" for p in fresh) > 1:
            extremes += _side_by_side(choice)
        numbers += [_denormal(choice, p) for p in fresh if p.per_channel == "yes"]
        boxes.append(_corners(choice))
    merged: dict[str, HardCase] = {}
    for case in (*directions, *extremes, *numbers, *boxes):
        before = merged[case.name].points if case.name in merged else ()
        merged[case.name] = HardCase(case.name, case.why, (*before, *case.points))
    return list(merged.values())
