"""The albedos of a material's terms over every direction, in coordinates whose even steps meet lobes of every width.

    cos theta = 1 / cosh u,   tan phi = sinh s / sinh(QUARTER - s)                                        [1]

A lobe's width acts through its product with tan theta = sinh u, and through the azimuth at which a narrow and a wide
principal direction take turns.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from ..models.form import Form, Term
from ..parameters import Values
from .albedo import of_form
from .probe import Symmetry, growth, symmetry

LOW, LOWEST = 1e-10, 1e-12  # the cosines of the last two rows, which tell what happens towards grazing
STEP_U, STEPS_S = 0.6, 12  # a step of u, and how many of s make a quarter turn
FIRST = (0.0, 0.03, 0.08, 0.16, 0.3)  # near the normal a kink at ci = co acts over the width of the lobe
STEEP, STEP_STEEP = 14.0, 3.0  # beyond this u, where cos theta = 2e-6, larger steps will do
QUARTER = 11.4  # s of the y axis: tan phi starts from exp(-QUARTER) = 1e-5, the smallest ratio of two widths
LOOSE = 1e-4  # tolerance of the two rows that tell an exponent
WEAKEST = 1e-2  # of reflectance 1, however little a material has of a term: it counts with this tolerance
TOLD = 2e-3  # how well the last two rows tell an exponent


class Lone(NamedTuple):
    """One term of a material as a material of its own, its ties replaced by values, its largest reflectance by 1."""

    form: Form
    values: Values
    reflectance: float
    symmetry: Symmetry


def lone_terms(form: Form, values: Values) -> tuple[Lone, ...]:
    """The terms one by one; those without reflectance are left out, unless all are without."""
    found = []
    for term in form.terms:
        alone = Form((Term(term.label, term.model),))
        own = {f"{term.label}.{name}": value for name, value in form.of_term(term, values).items()}
        reflectance, scale = 1.0, f"{term.label}.{term.model.scale}"
        if scale in own:
            reflectance = float(own[scale].max())
            own[scale] = own[scale] / reflectance if reflectance > 0 else torch.ones_like(own[scale])
        found.append(Lone(alone, own, reflectance, symmetry(alone, own)))
    return tuple(lone for lone in found if lone.reflectance > 0) or tuple(found[:1])


def theta_of(u: float) -> float:
    """The polar angle [rad] of the coordinate u."""
    return math.atan(math.sinh(u))


def azimuth_of(s: Tensor) -> Tensor:
    """The azimuth [rad] of the coordinate s; the y axis lies at QUARTER, and the other quarter turns follow."""
    turns = torch.floor(s / QUARTER)
    within = s - turns * QUARTER
    return torch.atan2(torch.sinh(within), torch.sinh(QUARTER - within)) + turns * (math.pi / 2)


class Scan:
    """Albedos at the coordinates, and what they cost.

    u: (U,), from the normal almost to the horizon; s: (S,), over as much of a turn as the terms' symmetry leaves.
    """

    def __init__(self, terms: Sequence[Lone], channels: int) -> None:
        self.terms, self.channels = terms, channels
        isotropic = all(term.symmetry.isotropic for term in terms)
        self.mirrored = all(term.symmetry.mirrored for term in terms)
        self.turn = 0.0 if isotropic else QUARTER if self.mirrored else 4 * QUARTER
        last = [math.acosh(1 / cosine) for cosine in (LOW, LOWEST)]
        rows = [*FIRST, *np.arange(STEP_U, STEEP, STEP_U), *np.arange(STEEP, last[0], STEP_STEEP), *last]
        self.u = torch.tensor(rows, dtype=torch.float64)
        self.s = torch.linspace(0, self.turn, 1 + round(self.turn / QUARTER) * STEPS_S, dtype=torch.float64)
        self.evaluations = 0

    def rows(self, u: Tensor, tolerance: float) -> tuple[Tensor, Tensor]:
        """The same as `albedos` for each u (U,) under every s of the scan: (T, U, S, C) each."""
        found = self.albedos(u.repeat_interleave(len(self.s)), self.s.repeat(len(u)), tolerance)
        parts, errors = (x.unflatten(1, (len(u), len(self.s))) for x in found)
        return parts, errors

    def albedos(self, u: Tensor, s: Tensor, tolerance: float) -> tuple[Tensor, Tensor]:
        """Each term's albedo [1] at pairs of u and s (N,), and the error claimed for it: (T, N, C) each."""
        parts, errors = [], []
        for form, values, reflectance, its in self.terms:
            # one direction for every azimuth where they are alike: of an isotropic term, and at the normal
            azimuth = torch.zeros_like(u) if its.isotropic else torch.where(u > 0, azimuth_of(s), 0.0)
            at, inverse = torch.unique(torch.stack([u, azimuth]), dim=1, return_inverse=True)
            allowed = min(tolerance / len(self.terms) / max(reflectance, 1e-300), WEAKEST)
            found = of_form(form, values, 1 / torch.cosh(at[0]), at[1], allowed)
            self.evaluations += found.evaluations
            parts.append(reflectance * found.values[inverse].expand(-1, self.channels))
            errors.append(reflectance * found.error[inverse].expand(-1, self.channels))
        # what no number holds counts as infinite
        albedo, error = (torch.stack(x).nan_to_num(nan=math.inf, posinf=math.inf) for x in (parts, errors))
        return albedo, error

    def exponents(self) -> Tensor:
        """The e of each term's albedo ~ (cos theta)^-e towards grazing, at least 0, (T, C).

        The albedos at two cosines tell it to about 1e-4; where f itself grows by an exponent that agrees, that one is
        exact.
        """
        u, s = (x.flatten() for x in torch.meshgrid(self.u[-2:], self.s[[0, -1]], indexing="ij"))
        parts, errors = (x.unflatten(1, (2, 2)) for x in self.albedos(u, s, LOOSE))
        lit = ((parts > 0) & parts.isfinite()).all(1)
        low, lowest = (torch.where(lit, row, 1.0) for row in parts.unbind(1))
        known = torch.where(lit, (errors / torch.where(lit.unsqueeze(1), parts, 1.0)).sum(1), 0.0)
        told, doubt = ((x / math.log(LOW / LOWEST)).amax(1) for x in (torch.log(lowest / low), known))
        doubt = doubt + TOLD
        told = torch.where(told > doubt, told, 0.0)
        for lone, row, its in zip(self.terms, told, doubt, strict=True):
            exact = growth(lone.form, lone.values)
            if exact is not None:
                row[(row - exact).abs() < its] = max(exact, 0.0)
        return torch.where(lit.any(1), told, 0.0)
