"""How an albedo is to be integrated: for each term a rule, and for each direction its size.

A plan is made without derivatives, for some values. `Plan.evaluate` integrates by it for any values near these: a pure
function, which can be differentiated, and batched by torch.func.vmap.
"""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from ..errors import InvalidValueError, unknown_name
from ..models._smith import SmithLobe
from ..models.form import Form, Term
from ..parameters import Values
from .arcs import Arcs
from .chords import Chords
from .closed_forms import EXACT, returned
from .hemisphere import Hemisphere
from .lobes import PROFILES, anisotropic
from .own_lobes import Lump, PowerCosine
from .product import Product
from .refinement import Integral, Rows
from .sampled import Drawn, drawn
from .slope_disc import SlopeDisc

METHODS = {
    "auto": "the cheapest of the next three for each term",
    "closed_form": "an exact form, or one integral of one dimension",
    "slope_disc": "rays over the disc of the half vector's slopes, for half-vector lobes",
    "hemisphere": "adaptive cells in the coordinates of the term's samples, for any lobe",
    "gauss_legendre": "Gauss-Legendre nodes in cos theta_i, equal steps in phi_i: to compare, fails for narrow lobes",
    "monte_carlo": "the mean weight of the material's own samples, for comparison",
    "sobol": "the same for scrambled Sobol points, for comparison",
}
SINGLE: dict[str, type[Integral]] = {
    "ward_bounded": Chords,
    "ward_neumann": Arcs,  # isotropic
    "lafortune": PowerCosine,
    "edwards": Lump,
}
RULES: dict[str, type[Integral] | type[Hemisphere]] = {
    "slope_disc": SlopeDisc,
    "hemisphere": Hemisphere,
    "gauss_legendre": Product,
}
NEGLECTED = 1e-4  # of the tolerance, outside of the nodes' reach
LEAST_NEGLECTED = 3e-17  # a rounding
ROUNDING = 4e-15  # of a closed form
SINGLE_SHARE = 0.98  # of the tolerance, for what a rule integrates; what is returned beside it is wrong by the rest


@dataclass(frozen=True, eq=False)
class Plan:
    """Rules and their sizes, and what they gave when they were chosen."""

    form: Form
    lead: tuple[int, ...]  # the shape of the directions
    rule: "Drawn | tuple[_Part, ...]"
    found: Tensor  # (..., C)
    error: Tensor  # (..., C), claimed
    evaluations: int
    method: str

    def evaluate(self, values: Mapping[str, Tensor]) -> Tensor:
        """The albedo [1], (..., C), for values near those of the plan."""
        flat = flattened(values, self.lead)
        if isinstance(self.rule, Drawn):
            total = self.rule.value(self.form, flat)
        else:
            total = functools.reduce(torch.add, (part.value(self.form, flat) for part in self.rule))
        return total.expand(self.found.numel() // self.found.shape[-1], -1).reshape(*self.lead, -1)


def flattened(values: Mapping[str, Tensor], lead: Sequence[int]) -> dict[str, Tensor]:
    """The values as (1, 1 or C), or (R, 1 or C) where they have the shape of the directions."""
    return {
        key: value.double().reshape(1, -1)
        if value.ndim < 2
        else value.double().expand(*lead, value.shape[-1]).reshape(-1, value.shape[-1])
        for key, value in values.items()
    }


@dataclass(frozen=True, eq=False)
class _Part:
    """How one term is integrated: by a rule, or exactly where there is none."""

    term: Term
    method: str
    rows: Rows
    rule: Integral | Hemisphere | None
    tolerance: float

    def value(self, form: Form, flat: Values) -> Tensor:
        """The term's albedo, (R or 1, C or 1)."""
        model, own, co = self.term.model, form.of_term(self.term, flat), self.rows.co[:, None]
        if self.rule is None:
            bases: Sequence[Tensor] = EXACT[model.name](model, own, co)
        else:
            bases = self.rule.bases(own).unbind(1)
        return _summed(model.coefficients(own), bases) + self.returned(own)[0]

    def returned(self, own: Values) -> tuple[Tensor, Tensor]:
        """What a compensated lobe returns, and the error claimed for it; 0 for others."""
        model = self.term.model
        if self.method != "slope_disc" or not isinstance(model, SmithLobe) or not model.compensated:
            return (self.rows.co.new_zeros(1, 1),) * 2
        albedo, wrong = returned(model, own, self.rows.co[:, None], self.tolerance)
        albedo = own["ks"] * albedo
        return albedo, wrong * albedo.detach()


def _summed(coefficients: Sequence[Tensor], bases: Sequence[Tensor]) -> Tensor:
    """The sum of the bases' coefficients times their integrals; compensation has a coefficient of its own beyond."""
    return functools.reduce(torch.add, (c * basis for c, basis in zip(coefficients, bases, strict=False)))


def plan(
    form: Form, values: Mapping[str, Tensor], cos_o: Tensor, azimuth: Tensor, tolerance: float, method: str = "auto"
) -> Plan:
    """The plan for a form and values; arguments and errors are those of `albedo.of_form`."""
    if method not in METHODS:
        raise unknown_name("the method", method, METHODS, field="method")
    if not 0 < tolerance < float("inf"):
        raise InvalidValueError(
            f"Expected tolerance to be above 0, got {tolerance:g}. It is the largest error of an albedo.",
            field="tolerance",
        )
    with torch.no_grad():
        cos_o, azimuth = cos_o.detach().double(), azimuth.detach().double()
        wrong = ~((cos_o > 0) & (cos_o <= 1))
        if bool(wrong.any()):
            raise InvalidValueError(
                f"Expected cos_o to be in (0, 1], got {float(cos_o[wrong].reshape(-1)[0]):.12g}. "
                "Give the cosine of the polar angle.",
                field="cos_o",
            )
        if not bool(azimuth.isfinite().all()):
            raise InvalidValueError(
                "Expected azimuth to be a number, got one that is not finite. Give it in radians.", field="azimuth"
            )
        shapes = (value.shape[:-1] for value in values.values() if value.ndim > 1)
        lead = tuple(torch.broadcast_shapes(cos_o.shape, azimuth.shape, *shapes))
        rows = Rows(cos_o.expand(lead).reshape(-1), azimuth.expand(lead).reshape(-1))
        # copies: nodes stay where they are when the values are changed in place
        flat = {key: value.detach().clone() for key, value in flattened(values, lead).items()}
        rule: Drawn | tuple[_Part, ...]
        if method in ("monte_carlo", "sobol"):
            rule, found, error, evaluations = drawn(form, flat, rows, tolerance, method)
        else:
            numeric = sum(_method(term, method) != "closed_form" or term.model.name in SINGLE for term in form.terms)
            planned = [_planned(form, term, flat, rows, tolerance / max(numeric, 1), method) for term in form.terms]
            rule = tuple(part for part, *_ in planned)
            found = functools.reduce(torch.add, (p[1] for p in planned))
            error = functools.reduce(torch.add, (p[2] for p in planned))
            evaluations = sum(p[3] for p in planned)
            method = " + ".join(dict.fromkeys(part.method for part in rule))
        found, error = (x.expand(len(rows.co), -1).reshape(*lead, -1) for x in torch.broadcast_tensors(found, error))
        return Plan(form, lead, rule, found, error, evaluations, method)


def _method(term: Term, method: str) -> str:
    """The method that integrates a term; raises where the one that was asked for does not suit it."""
    name = term.model.name
    closed = name in EXACT or (name in SINGLE and not (name == "ward_neumann" and anisotropic(term.model)))
    suited = [
        *(["closed_form"] if closed else []),
        *(["slope_disc"] if name in PROFILES else []),
        "hemisphere",
        "gauss_legendre",
    ]
    if method == "auto":
        return suited[0]
    if method not in suited:
        raise InvalidValueError(
            f"Expected method to suit {term.label}, got {method}. Use auto or {', '.join(suited)}.", field="method"
        )
    return method


def _planned(
    form: Form, term: Term, flat: Values, rows: Rows, tolerance: float, method: str
) -> tuple[_Part, Tensor, Tensor, int]:
    """How a term is integrated, its albedo (R or 1, C), the error claimed for it, and the evaluations."""
    method = _method(term, method)
    model, own = term.model, form.of_term(term, flat)
    if method == "closed_form" and model.name in EXACT:
        part = _Part(term, method, rows, None, tolerance)
        value = part.value(form, flat)
        return part, value, ROUNDING * value.abs(), 0
    lobe = model.single if isinstance(model, SmithLobe) and method == "slope_disc" else model
    coefficients = lobe.coefficients(own)
    kind = SINGLE[model.name] if method == "closed_form" else RULES[method]
    rule = kind(lobe, own, rows, max(NEGLECTED * tolerance, LEAST_NEGLECTED))
    weights = torch.stack(torch.broadcast_tensors(*(c.abs() for c in coefficients)), dim=1)
    found = rule.solve(weights, SINGLE_SHARE * tolerance)
    part = _Part(term, method, rows, rule, tolerance)
    returned_albedo, returned_error = part.returned(own)
    claimed = (torch.where(c == 0, 0.0, c.abs() * e) for c, e in zip(coefficients, found.error.unbind(1), strict=True))
    value = _summed(coefficients, found.bases.unbind(1)) + returned_albedo
    return part, value, functools.reduce(torch.add, claimed) + returned_error, found.evaluations
