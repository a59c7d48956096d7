"""The columns that a material's value and derivatives are made of, and of how much of each.

    f = sum over k of b_k c_k,    df/dp = sum over k of (db_k/dp c_k + b_k dc_k/dp)

The bases b and their derivatives, the columns, hold what differs from sample to sample; the coefficients c and their
derivatives hold what differs from channel to channel. A model computes a basis sample by sample, so with a parameter
repeated over the samples one backward pass gives the derivative at each of them: no Jacobian-vector products, and
nothing of torch.func, whose first use takes seconds (nor autograd's grad_outputs, which import as much).
"""

from collections.abc import Mapping
from typing import NamedTuple, cast

import torch
from torch import Tensor

from ..geometry import Geometry
from ..models._fresnel_lobe import FresnelTerm
from ..models.form import Form
from ..models.fresnel import schlick

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
            bases, coefficients = self._parts({**start, **leaves}, g)
            every = list(leaves.values())
            reads = [_reached(basis, every) for basis in bases]
            mixes = [_reached(coefficient, every) for coefficient in coefficients]
        self.bases = len(bases)
        self.multiples = self._multiples()
        self.wide = any(basis.shape[-1] > 1 for basis in bases)  # shapes that have colour
        self.derivatives = [(k, p) for k, found in enumerate(reads) for p in found]  # which basis, by which key
        self.coefficient_derivatives = [(k, p) for k, found in enumerate(mixes) for p in found]
        self.shaping = [p for p in range(len(keys)) if any(p == q for _, q in self.derivatives)]

    def _parts(self, values: Natural, g: Geometry) -> tuple[list[Tensor], list[Tensor]]:
        bases: list[Tensor] = []
        coefficients: list[Tensor] = []
        for term in self.form.terms:
            own = self.form.of_term(term, values)
            bases.extend(term.model.basis(own, g))
            coefficients.extend(term.model.coefficients(own))
        return bases, coefficients

    def _multiples(self) -> dict[int, int]:
        """The bases that are Schlick's s times the basis before them, by index: their columns need no derivation."""
        found: dict[int, int] = {}
        at = 0
        for term in self.form.terms:
            count = len(term.model.typical_albedo)
            if isinstance(term.model, FresnelTerm) and count == 2:
                found[at + 1] = at
            at += count
        return found

    def _coefficients(self, values: Natural) -> list[Tensor]:
        return [
            c for term in self.form.terms for c in term.model.coefficients(self.form.of_term(term, values))
        ]  # each broadcasts to (..., 1, C)

    def values(self, natural: Natural, g: Geometry, starts: int, channels: int) -> Tensor:
        """The bases alone [1/sr], (S, W, K, N), with W = C where shapes have colour, else 1."""
        with torch.no_grad():
            bases = self._bases(natural, g)
            return self._stacked(bases, starts, channels if self.wide else 1, len(g.above))

    def all(self, natural: Natural, g: Geometry, starts: int, channels: int) -> Tensor:
        """The bases, then their derivatives by the natural values, (S, W, Q, N)."""
        count, width = len(g.above), channels if self.wide else 1
        with torch.enable_grad():
            repeated = {
                p: natural[self.keys[p]].detach().expand(starts, count, width).requires_grad_() for p in self.shaping
            }
            bases = self._bases({**natural, **{self.keys[p]: leaf for p, leaf in repeated.items()}}, g)
            slopes: list[Tensor] = []
            for k, basis in enumerate(bases):
                by = [repeated[p] for j, p in self.derivatives if j == k]
                if k in self.multiples:
                    slopes += [schlick(g.h_dot_wo) * slope for slope in slopes[len(slopes) - len(by) :]]
                elif by:
                    slopes += torch.autograd.grad(basis.sum(), by, retain_graph=True)
        return self._stacked([basis.detach() for basis in bases] + slopes, starts, width, count)

    def _bases(self, values: Natural, g: Geometry) -> list[Tensor]:
        found: list[Tensor] = []
        for term in self.form.terms:
            own = self.form.of_term(term, values)
            if len(found) + 1 in self.multiples:
                lobe = cast(FresnelTerm, term.model).lobe(own, g)
                found += [lobe, lobe.detach() * schlick(g.h_dot_wo)]
            else:
                found.extend(term.model.basis(own, g))
        return found

    def _stacked(self, columns: list[Tensor], starts: int, width: int, count: int) -> Tensor:
        out = columns[0].new_empty(starts, width, len(columns), count)
        for i, column in enumerate(columns):
            out[:, :, i] = column.expand(starts, count, width).transpose(1, 2)
        return out

    def coefficients(self, natural: Natural, shape: tuple[int, ...]) -> Tensor:
        """The coefficients [1], (*shape, K), for values that broadcast to that shape."""
        with torch.no_grad():
            return torch.stack([c.expand(shape) for c in self._coefficients(natural)], dim=-1)

    def coefficient_slopes(self, natural: Natural, shape: tuple[int, ...]) -> Tensor:
        """The derivatives of the coefficients by the natural values, (*shape, K, P)."""
        slopes = torch.zeros(*shape, self.bases, len(self.keys), dtype=torch.float64)
        if not self.coefficient_derivatives:
            return slopes
        with torch.enable_grad():
            leaves = [natural[key].detach().expand(shape).requires_grad_() for key in self.keys]
            coefficients = self._coefficients({**natural, **dict(zip(self.keys, leaves, strict=True))})
            for k in range(self.bases):
                by = [p for j, p in self.coefficient_derivatives if j == k]
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


def _reached(value: Tensor, leaves: list[Tensor]) -> list[int]:
    """Which leaves a value is computed from."""
    if not leaves or not value.requires_grad:
        return []
    found = torch.autograd.grad(value.sum(), leaves, retain_graph=True, allow_unused=True)
    return [i for i, slope in enumerate(found) if slope is not None]
