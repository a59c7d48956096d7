"""A material as the plan leaves it: some terms, each with the options that it needs, and no more.

    f = sum over the kept terms;   uniform weights: f cos theta_i = sum of coefficient * pdf                  [1/sr]

What a term would compute in vain is taken out of it before anything is evaluated: equal widths make it isotropic, a
Fresnel factor that is 1 everywhere is no factor. The values stay the material's own and differentiable. Densities and
samples are without derivatives: f / pdf for fixed directions is differentiated by f alone, which stays right where a
shadow's or a light's edge would break the path of a moving sample.

Uniform weights are what renderers used before Walter 2005: a sample of a term counts with the term's reflectance. Their
mean is that of the f above, whatever f is.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import torch
from torch import Tensor

from ..energy import of_form
from ..energy.probe import symmetry
from ..geometry import geometry
from ..models import Model
from ..models.form import Form, Term
from ..models.material import Material

# the word of an option that computes more, and the one that takes its place
LESS = {"anisotropic": "isotropic", "schlick": "constant", "scaled": "constant", "compensated": "single"}
AZIMUTHS = 5  # at which anisotropic albedos are looked at; they change slowly
FLATTEST = 28 / (23 * math.pi)  # the largest f [1/sr] of a diffuse term of reflectance 1: Ashikhmin and Shirley's
DIFFUSE = ("lambert", "coupled_lambert", "ashikhmin_shirley_diffuse")


@dataclass(frozen=True, eq=False)
class Surface:
    """A material without the terms in `dropped`, and with the words of `LESS` replaced where `simpler` says so."""

    material: Material
    dropped: frozenset[str] = frozenset()  # labels
    simpler: Mapping[str, frozenset[str]] = field(default_factory=dict)  # label -> words
    uniform_weights: bool = False

    @cached_property
    def form(self) -> Form:
        """The kept terms, without ties."""
        kept = [term for term in self.material.form.terms if term.label not in self.dropped]
        return Form(tuple(Term(t.label, simplified(t.model, self.simpler.get(t.label, frozenset()))) for t in kept))

    def values(self, like: Tensor) -> dict[str, Tensor]:
        """The values of the kept terms, in the precision and on the device of another tensor."""
        full = {key: value.to(dtype=like.dtype, device=like.device) for key, value in self.material.values().items()}
        terms = {term.label: term for term in self.material.form.terms}
        found = {}
        for kept in self.form.terms:
            own = self.material.form.of_term(terms[kept.label], full)
            for name, value in _moved(terms[kept.label].model, kept.model, own).items():
                found[f"{kept.label}.{name}"] = value
        return found

    @property
    def black(self) -> bool:
        """Whether no term is left."""
        return len(self.dropped) == len(self.material.form.terms)

    @property
    def count(self) -> int:
        """How many terms are evaluated."""
        return len(self.form.terms)

    @property
    def peak(self) -> float:
        """The largest f cos theta_i [1/sr] over all directions of diffuse terms; inf where there is a lobe."""
        values = self.values(torch.zeros((), dtype=torch.float64))
        total = 0.0
        for term in self.form.terms:
            coefficients = term.model.coefficients(self.form.of_term(term, values))
            largest = max(float(c.detach().max()) for c in coefficients)
            if largest == 0:
                continue
            if term.model.name not in DIFFUSE:
                return math.inf
            total += FLATTEST * largest
        return total

    def without(self, label: str) -> "Surface":
        """The surface without a term."""
        return replace(self, dropped=self.dropped | {label})

    def albedos(self, theta: Tensor, tolerance: float) -> Tensor:
        """Albedos [1] with the error claimed for them, (angles, azimuths, C), for theta [rad]."""
        if self.black:
            return torch.zeros(1, 1, 1, dtype=torch.float64)
        with torch.no_grad():
            values = self.values(theta)
            azimuths = 1 if symmetry(self.form, values).isotropic else AZIMUTHS
            phi = torch.linspace(0, torch.pi / 2, azimuths, dtype=torch.float64)
            found = of_form(self.form, values, torch.cos(theta)[:, None], phi, tolerance)
        return found.values + found.error.nan_to_num(posinf=0.0)

    def frozen(self) -> Material:
        """The kept terms as a material of its own, without derivatives."""
        values = self.values(torch.zeros((), dtype=torch.float64))
        return Material(self.form, {key: value.detach() for key, value in values.items()})

    def reflected(self, wi: Tensor, wo: Tensor) -> Tensor:
        """The product f cos theta_i [1/sr], (..., C) or (..., 1)."""
        if self.black:
            return torch.zeros_like(wi[..., :1])
        values = self.values(wi)
        if not self.uniform_weights:
            return self.form.f(values, geometry(wi, wo, self.form.needs)) * wi[..., 2:].clamp(min=0)
        g = geometry(wi, wo, self.form.pdf_needs)
        total = wi.new_zeros(())
        for term in self.form.terms:
            own = self.form.of_term(term, values)
            parts = zip(term.model.coefficients(own), term.model.typical_albedo, strict=True)
            reflectance = sum(torch.atleast_1d(c) * albedo for c, albedo in parts)
            total = total + term.model.pdf(own, g).detach() * reflectance
        return torch.where(g.above, total, 0.0)

    def pdf(self, wi: Tensor, wo: Tensor) -> Tensor:
        """The density of `sample` [1/sr], (...), without derivatives."""
        if self.black:
            return torch.zeros_like(wi[..., 0])
        with torch.no_grad():
            return self.form.pdf(self.values(wi), geometry(wi, wo, self.form.pdf_needs))

    def sample(self, wo: Tensor, u: Tensor) -> Tensor:
        """Directions wi (..., 3) for u (..., 3), without derivatives."""
        if self.black:
            return -wo
        with torch.no_grad():
            u = u.clamp(max=1 - torch.finfo(u.dtype).eps / 2)
            return self.form.sample(self.values(wo), wo, u)


def simplified(model: Model, words: frozenset[str]) -> Model:
    """The model with each of these words replaced by the one that computes less."""
    return type(model)([LESS[word] if word in words else word for word in model.options]) if words else model


def replaceable(model: Model) -> list[str]:
    """The words of a model's options that `LESS` can replace."""
    groups = {word: group for group in model.option_groups for word in group}
    return [word for word in model.options if word in LESS and LESS[word] in groups[word]]


def widths(model: Model, own: Mapping[str, Tensor]) -> tuple[Tensor, Tensor] | None:
    """The two widths or exponents that an isotropic form would have as one; None where that is not their relation."""
    lone = set(simplified(model, frozenset({"anisotropic"})).parameter) - set(own)
    pair = [name for name in own if name not in simplified(model, frozenset({"anisotropic"})).parameter]
    return (own[pair[0]], own[pair[1]]) if len(lone) == 1 and len(pair) == 2 else None


def _moved(model: Model, simpler: Model, own: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The values of the simpler model that make it the model, where what was replaced has no effect."""
    values = dict(own)
    if "constant" in simpler.options and "constant" not in model.options:
        values["ks"] = own["ks"] * own["f0"] if "ks" in own else own["f0"]
    for name in simpler.parameter:
        if name not in values:  # the one width of two equal ones
            pair = widths(model, own)
            assert pair is not None, name  # noqa: S101 - the plan asks for no other
            values[name] = 0.5 * (pair[0] + pair[1])  # so that both are differentiated
    return {name: values[name] for name in simpler.parameter}
