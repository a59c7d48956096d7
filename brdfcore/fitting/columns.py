"""The columns that a material's value and derivatives are made of, and of how much of each.

    f = sum over k of b_k c_k,    df/dp = sum over k of (db_k/dp c_k + b_k dc_k/dp)

The bases b and their derivatives, the columns, hold what differs from sample to sample; the coefficients c and their
derivatives hold what differs from channel to channel. A model computes a basis sample by sample, so with a parameter
repeated over the samples one backward pass gives the derivative at each of them: no Jacobian-vector products, and
nothing of torch.func, whose first use takes seconds (nor autograd's grad_outputs, which import as much). Where a model
gives the derivatives of its lobe's logarithm, even that pass is saved: it takes four times as long as the lobe itself.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, cast

import torch
from torch import Tensor

from ..geometry import Geometry
from ..models._fresnel_lobe import FresnelTerm
from ..models._half_vector import WidthLobe
from ..models._scaled_lobe import ScaledLobe
from ..models.form import Form, Term
from ..models.fresnel import schlick

Lobe = FresnelTerm | ScaledLobe
Natural = Mapping[str, Tensor]  # key -> (S, 1, 1) or (S, 1, C), or (), (C,) for what is the same in all S


class Mix(NamedTuple):
    """How the value and its derivatives mix the columns."""

    value: Tensor  # (S, C, Q), 0 for the derivatives of bases
    slopes: Tensor  # (S, C, Q, P)


class Columns:
    """The bases of a form and their derivatives by some of its free parameters."""

    def __init__(self, form: Form, start: Natural, keys: tuple[str, ...], g: Geometry) -> None:
        """The structure of the form, read from an evaluation at the start and a few samples of the geometry."""
        self.form = form
        self.keys = keys
        with torch.enable_grad():
            leaves = {key: start[key].detach().clone().requires_grad_() for key in keys}
            values, every = {**start, **leaves}, list(leaves.values())
            bases = [term.model.basis(form.of_term(term, values), g) for term in form.terms]
            reads = [[_reached(basis, every) for basis in each] for each in bases]
            coefficients = self._coefficients(values)
            mixes = [_reached(coefficient, every) for coefficient in coefficients]
        flat = [found for each in reads for found in each]
        self.bases = len(flat)
        self.wide = any(basis.shape[-1] > 1 for each in bases for basis in each)  # shapes that have colour
        self.derivatives = [(k, p) for k, found in enumerate(flat) for p in found]  # which basis, by which key
        self.coefficient_derivatives = [(k, p) for k, found in enumerate(mixes) for p in found]
        self._own = [(k, p) for k, c in enumerate(coefficients) for p, leaf in enumerate(every) if c is leaf]
        self._mixed = [pair for pair in self.coefficient_derivatives if pair not in self._own]
        self.terms = [
            _TermColumns.of(term, [[keys[p] for p in found] for found in each], form.of_term(term, start), g)
            for term, each in zip(form.terms, reads, strict=True)
        ]

    def _coefficients(self, values: Natural) -> list[Tensor]:
        return [
            c for term in self.form.terms for c in term.model.coefficients(self.form.of_term(term, values))
        ]  # each broadcasts to (..., 1, C)

    def values(self, natural: Natural, g: Geometry, starts: int, channels: int) -> Tensor:
        """The bases alone [1/sr], (S, W, K, N), with W = C where shapes have colour, else 1."""
        out = torch.empty(starts, channels if self.wide else 1, self.bases, len(g.above), dtype=torch.float64)
        with torch.no_grad():
            bases = [b for one in self.terms for b in one.bases(self.form.of_term(one.term, natural), g)]
        for k, basis in enumerate(bases):
            out[:, :, k] = torch.atleast_2d(basis).mT
        return out

    def all(self, natural: Natural, g: Geometry, starts: int, channels: int) -> Tensor:
        """The bases, then their derivatives by the natural values, (S, W, Q, N)."""
        count, width = len(g.above), channels if self.wide else 1
        out = torch.empty(starts, width, self.bases + len(self.derivatives), count, dtype=torch.float64)
        k, j = 0, self.bases
        for one in self.terms:
            bases, slopes = one.derived(self.form, natural, g, (starts, count, width))
            for i, column in enumerate(bases):
                out[:, :, k + i] = torch.atleast_2d(column).mT
            for i, column in enumerate(slopes):
                out[:, :, j + i] = torch.atleast_2d(column).mT
            if one.schlick:
                s, more = schlick(g.h_dot_wo)[:, 0], len(slopes)
                torch.mul(out[:, :, k], s, out=out[:, :, k + 1])
                torch.mul(out[:, :, j : j + more], s, out=out[:, :, j + more : j + 2 * more])
            k, j = k + len(one.reads), j + sum(map(len, one.reads))
        return out

    def coefficients(self, natural: Natural, shape: tuple[int, ...]) -> Tensor:
        """The coefficients [1], (*shape, K), for values that broadcast to that shape."""
        with torch.no_grad():
            return torch.stack([c.expand(shape) for c in self._coefficients(natural)], dim=-1)

    def coefficient_slopes(self, natural: Natural, shape: tuple[int, ...]) -> Tensor:
        """The derivatives of the coefficients by the natural values, (*shape, K, P)."""
        slopes = torch.zeros(*shape, self.bases, len(self.keys), dtype=torch.float64)
        for k, p in self._own:  # the coefficient is the value itself
            slopes[..., k, p] = 1.0
        if not self._mixed:
            return slopes
        with torch.enable_grad():
            leaves = [natural[key].detach().expand(shape).requires_grad_() for key in self.keys]
            coefficients = self._coefficients({**natural, **dict(zip(self.keys, leaves, strict=True))})
            for k in range(self.bases):
                by = [p for j, p in self._mixed if j == k]
                if by:
                    found = torch.autograd.grad(
                        coefficients[k].expand(shape).sum(), [leaves[p] for p in by], retain_graph=True
                    )
                    for p, slope in zip(by, found, strict=True):
                        slopes[..., k, p] = slope
        return slopes

    def mix(self, coefficients: Tensor, coefficient_slopes: Tensor, chain: Tensor) -> Mix:
        """The mix of these coefficients (S, C, K) and slopes (S, C, K, P); chain (S, C, P) makes them of raw values."""
        *lead, _ = coefficients.shape
        width = self.bases + len(self.derivatives)
        value = coefficients.new_zeros(*lead, width)
        value[..., : self.bases] = coefficients
        slopes = coefficients.new_zeros(*lead, width, len(self.keys))
        slopes[..., : self.bases, :] = coefficient_slopes
        for j, (k, p) in enumerate(self.derivatives):
            slopes[..., self.bases + j, p] = coefficients[..., k]
        return Mix(value, slopes * chain.unsqueeze(-2))


@dataclass(frozen=True)
class _TermColumns:
    """What one term adds to the columns."""

    term: Term
    reads: list[list[str]]  # the keys that shape each basis
    schlick: bool  # the second basis is the first times Schlick's s, and so are its derivatives
    explicit: tuple[str, ...] | None  # what shapes the lobe, where the model gives its logarithm's derivatives

    @classmethod
    def of(cls, term: Term, reads: list[list[str]], start: Natural, g: Geometry) -> "_TermColumns":
        """A term whose bases read these keys."""
        model = term.model
        fresnel = isinstance(model, FresnelTerm) and len(model.typical_albedo) == 2
        names = [key.removeprefix(f"{term.label}.") for key in reads[0]]
        plain = isinstance(model, ScaledLobe) or (isinstance(model, FresnelTerm) and not model.exact)
        known = model.log_slopes(start, g) if isinstance(model, WidthLobe) and plain else {}
        # a shape that a tie takes from elsewhere is not among the names, or shapes the lobe by another's key
        tied = {name for name in known if name in term.tied}
        explicit = tuple(names) if names and set(names) <= set(known) and not tied else None
        return cls(term, reads, fresnel, explicit)

    def bases(self, own: Natural, g: Geometry) -> list[Tensor]:
        """The term's bases at its own values."""
        return list(self.term.model.basis(own, g))

    def derived(
        self, form: Form, natural: Natural, g: Geometry, shape: tuple[int, ...]
    ) -> tuple[list[Tensor], list[Tensor]]:
        """The bases and their derivatives, each (S, N, W) or broadcasting to it; of the lobe alone before Schlick's."""
        if self.explicit is None and any(self.reads):
            bases, slopes = self._by_backward_passes(form, natural, g, shape)
        else:
            own = form.of_term(self.term, natural)
            with torch.no_grad():
                if self.explicit is None:
                    return self.bases(own, g)[: 1 if self.schlick else None], []
                lobe = cast(Lobe, self.term.model).lobe(own, g)
                by = cast(WidthLobe, self.term.model).log_slopes(own, g)
                return [lobe], [lobe * by[name] for name in self.explicit]
        return bases, slopes

    def _by_backward_passes(
        self, form: Form, natural: Natural, g: Geometry, shape: tuple[int, ...]
    ) -> tuple[list[Tensor], list[Tensor]]:
        """The same, of the lobe alone where Schlick's s follows."""
        with torch.enable_grad():
            keys = {key for each in self.reads for key in each}
            leaves = {key: natural[key].detach().expand(shape).requires_grad_() for key in keys}
            own = form.of_term(self.term, {**natural, **leaves})
            bases = [cast(FresnelTerm, self.term.model).lobe(own, g)] if self.schlick else self.bases(own, g)
            slopes: list[Tensor] = []
            for basis, each in zip(bases, self.reads, strict=False):
                if each:
                    slopes += torch.autograd.grad(basis.sum(), [leaves[key] for key in each], retain_graph=True)
        return [basis.detach() for basis in bases], slopes


def _reached(value: Tensor, leaves: list[Tensor]) -> list[int]:
    """Which leaves a value is computed from."""
    if not leaves or not value.requires_grad:
        return []
    found = torch.autograd.grad(value.sum(), leaves, retain_graph=True, allow_unused=True)
    return [i for i, slope in enumerate(found) if slope is not None]
