"""Which values of a fit are linear: the unknowns z in which the model is affine, whatever the shapes are.

    c = offset + A z,     f = sum over k of b_k c_k

Legal groups, the first that a term allows:

    pair         ks f0 and ks (1 - f0), where f0 is free and has a value a channel as ks has; their sum is <= ks's end
    f0           of Ashikhmin and Shirley's own form, c = (f0, 1 - f0)
    absorbed     kd (1 - f0), where a diffuse term reads an f0 of one of these; with f0 itself its sum is <= 1
    scale        a reflectance that multiplies its term; other terms may read it as theirs, or as a total minus it

An f0 that something else reads, that is gray while ks is not, or that has a box of the user's, is no unknown but a
shape: it is searched.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import torch
from torch import Tensor

from ..models import Model
from ..models.form import Term
from .plan import Plan

Kind = Literal["scale", "pair", "f0", "absorbed"]


@dataclass(frozen=True)
class Group:
    """Unknowns that belong together: a reflectance, or those of a pair, or f0 and what is absorbed with it."""

    kind: Kind
    scale: str  # ks of a pair, kd of what is absorbed, f0 of itself, else the reflectance
    f0: str | None = None
    at: int = 0  # of its first unknown

    @property
    def count(self) -> int:
        """How many unknowns it has."""
        return 2 if self.kind == "pair" else 1


def groups(plan: Plan) -> tuple[Group, ...]:
    """The groups of a plan, terms that own an f0 before those that read it."""
    found: list[Group] = []
    for term in plan.form.terms:
        group = _of_lobe(plan, term)
        if group is not None:
            found.append(group)
    fresnel = {group.f0: group for group in found if group.f0 is not None}
    for term in plan.form.terms:
        read = term.tied.get("f0")
        key = f"{term.label}.{term.model.scale}"
        if read is not None and read.owner in fresnel:
            found.append(Group("absorbed", key, read.owner))
        elif _is_scale(plan, key) and not any(group.scale == key for group in found):
            found.append(Group("scale", key))
    at = 0
    placed = []
    for group in found:
        placed.append(Group(group.kind, group.scale, group.f0, at))
        at += group.count
    return tuple(placed)


def _of_lobe(plan: Plan, term: Term) -> Group | None:
    """The group in which a lobe's f0 is an unknown, where that is legal."""
    f0, ks = f"{term.label}.f0", f"{term.label}.ks"
    if f0 not in plan.free or f0 in plan.bounds:
        return None
    if _splits(term.model, with_ks=False):
        group = Group("f0", f0, f0)
    elif (
        _splits(term.model, with_ks=True)
        and _is_scale(plan, ks)
        and plan.start[ks].shape == plan.start[f0].shape
        and ks not in _owners(plan)
        and plan.bounds.get(ks, (0.0, 1.0))[0] == 0
    ):
        group = Group("pair", ks, f0)
    else:
        return None
    readers = [key for key, tie in plan.form.ties.items() if tie.owner == f0]
    if len(readers) > 1 or not all(_absorbs(plan, reader, f0) for reader in readers):
        return None
    return group


def _absorbs(plan: Plan, reader: str, f0: str) -> bool:
    """Whether the tied parameter only scales its term by 1 - f0, beside a reflectance that is free to take that up."""
    term = next(term for term in plan.form.terms if reader == f"{term.label}.f0")
    scale = f"{term.label}.{term.model.scale}"
    return (
        reader.endswith(".f0")
        and term.tied["f0"].total is None
        and scale in plan.free
        and scale not in _owners(plan)
        and scale not in plan.bounds
        and plan.start[scale].shape == plan.start[f0].shape
        and _coefficients(term.model, {term.model.scale: 0.5, "f0": 0.25}) == (0.375,)
    )


def _is_scale(plan: Plan, key: str) -> bool:
    """Whether a key is a free reflectance that scales its term, and others read it at most as their own scale."""
    scales = {f"{term.label}.{term.model.scale}" for term in plan.form.terms}
    return (
        key in plan.free
        and key in scales
        and all(tied in scales for tied, tie in plan.form.ties.items() if tie.owner == key)
    )


def _owners(plan: Plan) -> set[str]:
    return {tie.owner for tie in plan.form.ties.values()}


def _splits(model: Model, *, with_ks: bool) -> bool:
    """Whether a model's coefficients are ks f0 and ks (1 - f0), or f0 and 1 - f0."""
    if "f0" not in model.parameter or ("ks" in model.parameter) != with_ks:
        return False
    scale = 0.5 if with_ks else 1.0
    return _coefficients(model, {"ks": 0.5, "f0": 0.25}) == (0.25 * scale, 0.75 * scale)


def _coefficients(model: Model, given: Mapping[str, float]) -> tuple[float, ...]:
    values = {
        name: torch.tensor(given.get(name, parameter.default), dtype=torch.float64)
        for name, parameter in model.parameter.items()
    }
    return tuple(float(c) for c in model.coefficients(values))


def natural_of(groups: tuple[Group, ...], z: Tensor, otherwise: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The natural values of unknowns z (..., L) by key, each (...); an f0 that no unknown shows stays `otherwise`'s."""
    values: dict[str, Tensor] = {}
    for group in groups:
        here = z[..., group.at]
        if group.kind == "pair" and group.f0 is not None:
            total = here + z[..., group.at + 1]
            lit = total > 0
            values[group.scale] = total
            values[group.f0] = torch.where(
                lit, (here / torch.where(lit, total, 1.0)).clamp(0, 1), otherwise[group.f0].expand_as(total)
            )
        elif group.kind == "absorbed" and group.f0 is not None:
            left = 1 - values[group.f0]
            values[group.scale] = torch.where(left > 0, here / torch.where(left > 0, left, 1.0), 0.0)
        else:
            values[group.scale] = here
    return values
