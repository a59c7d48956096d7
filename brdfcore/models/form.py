"""A material's structure: its terms, their options and ties, and the pure functions that evaluate them.

A Form never changes and holds no numbers but the totals of its ties. Its functions take the values (one flat mapping,
"label.name" -> () or (C,)) and the geometry, so they can be differentiated, batched by vmap, and compiled.
"""

import functools
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import torch
from torch import Tensor

from .._types import Density, Directions, Spectrum
from ..errors import ModelTextError, unknown_name
from ..geometry import Geometry
from ..parameters import Parameter, Values
from . import MODELS, Model
from .presets import PRESETS
from .text import ParsedTerm, Tie, number_text


@dataclass(frozen=True)
class Term:
    """One summand: a model with its options chosen, under a label, some of its parameters tied to other terms'."""

    label: str
    model: Model
    ties: tuple[tuple[str, Tie], ...] = ()

    @cached_property
    def tied(self) -> dict[str, Tie]:
        """The ties by parameter name."""
        return dict(self.ties)


@dataclass(frozen=True)
class Form:
    """The sum of its terms."""

    terms: tuple[Term, ...]

    def __post_init__(self) -> None:
        for term in self.terms:
            for name, tie in term.ties:
                self._check_tie(f"{term.label}.{name}", tie)

    def _check_tie(self, key: str, tie: Tie) -> None:
        if tie.owner == key:
            raise ModelTextError(
                f"Expected {key} to be tied to another parameter, got itself. Name the owner.", field=key
            )
        if tie.owner in self.ties:
            further = self.ties[tie.owner].owner
            advice = f"Tie {key} to {further}." if further != key else f"Give {key} or {tie.owner} a value."
            raise ModelTextError(
                f"Expected {key} to be tied to a free parameter, got {tie.owner}, which is tied itself. {advice}",
                field=key,
            )
        if tie.owner not in self.parameters:
            raise unknown_name(f"the owner of {key}", tie.owner, self.parameters, field="model")

    @cached_property
    def ties(self) -> dict[str, Tie]:
        """Every tie by the key of the tied parameter."""
        return {f"{term.label}.{name}": tie for term in self.terms for name, tie in term.ties}

    @cached_property
    def parameters(self) -> dict[str, Parameter]:
        """The parameters that have a value of their own, by key, in the order of the text."""
        return {
            f"{term.label}.{parameter.name}": parameter
            for term in self.terms
            for parameter in term.model.parameters
            if parameter.name not in term.tied
        }

    @cached_property
    def all_parameters(self) -> dict[str, Parameter]:
        """Every parameter by key, tied ones included."""
        return {f"{term.label}.{p.name}": p for term in self.terms for p in term.model.parameters}

    @cached_property
    def needs(self) -> frozenset[str]:
        """The quantities of the geometry that `f` reads."""
        return frozenset().union(*(term.model.needs for term in self.terms))

    @cached_property
    def pdf_needs(self) -> frozenset[str]:
        """The quantities of the geometry that `pdf` reads."""
        return frozenset().union(*(term.model.pdf_needs for term in self.terms))

    def resolve(self, key: str, values: Values) -> Tensor:
        """The value of any parameter, tied ones included; a difference stays in its box whatever its owner does."""
        tie = self.ties.get(key)
        if tie is None:
            return values[key]
        if tie.total is None:
            return values[tie.owner]
        difference = self.difference(tie, values)
        return difference.clamp(*self.all_parameters[key].ends(difference.dtype))

    def difference(self, tie: Tie, values: Values) -> Tensor:
        """The known total of a tie minus its owner's value."""
        owner, totals = values[tie.owner], tie.total or (0.0,)
        return owner.new_tensor(totals if len(totals) > 1 else totals[0]) - owner

    def of_term(self, term: Term, values: Values) -> dict[str, Tensor]:
        """The values of one term, by the names that its model knows."""
        return {name: self.resolve(f"{term.label}.{name}", values) for name in term.model.parameter}

    def bounds(self, key: str, like: Tensor) -> tuple[Tensor, Tensor]:
        """The smallest and largest values of a free parameter, shaped and typed as `like`, () or (C,).

        They are the ends of its box, narrowed where a parameter that is tied to it would leave its own.
        """
        low, high = (torch.full_like(like, end) for end in self.parameters[key].ends(like.dtype))
        for tied, tie in self.ties.items():
            if tie.owner == key:
                tied_low, tied_high = self.all_parameters[tied].ends(like.dtype)
                if tie.total is None:
                    low, high = low.clamp(min=tied_low), high.clamp(max=tied_high)
                else:  # the owner lies in total - [tied_low, tied_high], for every channel where it is gray
                    totals = like.new_tensor(tie.total)
                    totals = totals if like.ndim else torch.stack([totals.max(), totals.min()])
                    above, below = (totals, totals) if like.ndim else totals.unbind()
                    low, high = torch.maximum(low, above - tied_high), torch.minimum(high, below - tied_low)
        return low, high

    def f(self, values: Values, g: Geometry) -> Spectrum:
        """The BRDF [1/sr], (..., C), or (..., 1) where nothing has colour; exactly 0 below the horizon."""
        parts: list[tuple[Tensor, Tensor]] = []
        for term in self.terms:
            own = self.of_term(term, values)
            parts.extend(zip(term.model.basis(own, g), term.model.coefficients(own), strict=True))
        shared = [(basis, torch.atleast_1d(c)) for basis, c in parts if basis.shape[-1] == 1]
        sums = [basis * c for basis, c in parts if basis.shape[-1] > 1]  # shapes that have colour themselves
        if len(shared) > 1:  # one matrix product for all channels
            bases, coefficients = zip(*shared, strict=True)
            sums.append(_columns(bases) @ torch.stack(torch.broadcast_tensors(*coefficients)))
        else:
            sums.extend(basis * c for basis, c in shared)
        total = functools.reduce(torch.add, sums)
        return torch.where(g.above, total, 0.0)

    def shares(self, values: Values) -> Tensor:
        """The probability with which `sample` draws from each term, (T,): about its part of the albedo, detached."""
        weights = []
        for term in self.terms:
            own = {name: value.detach() for name, value in self.of_term(term, values).items()}
            parts = zip(term.model.coefficients(own), term.model.typical_albedo, strict=True)
            weights.append(torch.stack([c.mean() * albedo for c, albedo in parts]).sum())
        weight = torch.stack(weights)
        total = weight.sum()
        return torch.where(total > 0, weight / torch.where(total > 0, total, 1.0), 1 / len(weights))

    def pdf(self, values: Values, g: Geometry) -> Density:
        """The density of `sample` per solid angle [1/sr], (...); its integral falls short of 1 by what is lost."""
        densities = [term.model.pdf(self.of_term(term, values), g) for term in self.terms]
        total = densities[0].squeeze(-1) if len(densities) == 1 else _columns(densities) @ self.shares(values)
        return torch.where(g.above.squeeze(-1), total, 0.0)

    def sample(self, values: Values, wo: Directions, u: Directions) -> Directions:
        """Directions wi (..., 3) for u (..., 3) uniform in [0, 1): u[0] picks the term, the rest is its own."""
        normal = wo.new_tensor([0.0, 0.0, 1.0])
        wo, u = torch.broadcast_tensors(torch.where(wo[..., 2:] <= 0, normal, wo), u)  # a NaN goes on
        drawn = [term.model.sample(self.of_term(term, values), wo, u[..., 1:]) for term in self.terms]
        if len(drawn) == 1:
            return drawn[0]
        upper = self.shares(values).cumsum(0)
        wi = drawn[-1]
        for index in range(len(drawn) - 2, -1, -1):
            wi = torch.where(u[..., :1] < upper[index], drawn[index], wi)
        return wi

    def text(self, values: Mapping[str, Sequence[float] | float] | None = None) -> str:
        """The text form, with the values where they are given."""
        parts = []
        for term in self.terms:
            arguments = list(term.model.options)
            for name in term.model.parameter:
                key = f"{term.label}.{name}"
                if name in term.tied:
                    tie = term.tied[name]
                    total = "" if tie.total is None else number_text(_scalar(tie.total)) + " - "
                    arguments.append(f"{name}={total}{tie.owner}")
                elif values is not None and key in values:
                    value = values[key]
                    arguments.append(f"{name}={number_text(value if isinstance(value, float) else tuple(value))}")
            parts.append(f"{term.model.name}({', '.join(arguments)})" if arguments else term.model.name)
        return " + ".join(parts)

    def to_json(self) -> list[dict[str, Any]]:
        """The structure as JSON-able data."""
        return [
            {
                "label": term.label,
                "model": term.model.name,
                "options": list(term.model.options),
                "ties": {
                    name: {"owner": tie.owner, "total": None if tie.total is None else list(tie.total)}
                    for name, tie in term.ties
                },
            }
            for term in self.terms
        ]


def _columns(parts: Sequence[Tensor]) -> Tensor:
    """Parts (..., 1) side by side, (..., K)."""
    return torch.cat(torch.broadcast_tensors(*parts), dim=-1)


def _scalar(numbers: tuple[float, ...]) -> tuple[float, ...] | float:
    return numbers[0] if len(numbers) == 1 else numbers


def build(
    parsed: Sequence[ParsedTerm], prefer: Sequence[str] = ()
) -> tuple[Form, dict[str, float | tuple[float, ...]], dict[str, tuple[str, ...]]]:
    """The form of a parsed text, the values that the text gives, and the option words it left open by label.

    Where the text leaves a group of options open, a word of `prefer` decides, else the group's first.
    """
    seen: Counter[str] = Counter()
    terms = []
    values: dict[str, float | tuple[float, ...]] = {}
    left_open: dict[str, tuple[str, ...]] = {}
    for term in parsed:
        if term.name not in MODELS:
            if len(parsed) == 1 and term.bare:
                raise unknown_name("a model or preset", term.name, [*MODELS, *PRESETS], field="model")
            raise unknown_name("a model", term.name, MODELS, field="model")
        seen[term.name] += 1
        label = term.name if seen[term.name] == 1 else f"{term.name}_{seen[term.name]}"
        possible = MODELS[term.name].with_words(term.words, tuple(term.arguments))
        model = max(possible, key=lambda m: sum(word in prefer for word in m.options))  # the first of the best
        varied = {word for m in possible for word in m.options} - frozenset.intersection(
            *(frozenset(m.options) for m in possible)
        )
        left_open[label] = tuple(word for word in model.options if word in varied)
        terms.append(Term(label, model, tuple((name, a) for name, a in term.arguments.items() if isinstance(a, Tie))))
        values.update({f"{label}.{name}": a for name, a in term.arguments.items() if not isinstance(a, Tie)})
    return Form(tuple(terms)), values, left_open
