"""Values, densities and gradients of every model and choice of options against 60-digit textbook formulas."""

import math

import numpy as np
import pytest
import reference
import torch
from model_cases import (
    CEILING,
    CHOICE_IDS,
    DTYPES,
    EPS,
    EVERY_CHOICE,
    GRADIENT,
    TAIL,
    VALUE,
    above_horizon,
    draw_values,
    entry,
    form_of,
    lobe_pairs,
    material_of,
)
from reference import exact, mp

import brdfcore as bc
from brdfcore.geometry import FLOOR, geometry

every_choice = pytest.mark.parametrize("choice", EVERY_CHOICE, ids=CHOICE_IDS)
every_dtype = pytest.mark.parametrize("dtype", DTYPES, ids=["float32", "float64"])


def drawn_from_box(choice: bc.Model, rng: np.random.Generator) -> list[dict[str, object]]:
    """Values from the whole box, and with the shapes (stored as logarithms) on their lowest and highest values."""
    shapes = [p for p in choice.parameters if p.scale == "log"]
    ends = [{p.name: p.low for p in shapes}, {p.name: p.high for p in shapes}]
    return [draw_values(choice, rng, where="box") | end for end in ({}, {}, {}, {}, *ends)]


def stored_values(choice: bc.Model, values: dict[str, object], dtype: torch.dtype) -> dict[str, torch.Tensor]:
    """The values as the model sees them, by key: rounded to the dtype of the directions."""
    return {k: v.detach().to(dtype) for k, v in material_of(choice, values).values().items()}


def numbers(values: dict[str, torch.Tensor]) -> dict[str, mp.mpf]:
    return {key.split(".")[1]: mp.mpf(float(value)) for key, value in values.items()}


def condition(choice: bc.Model, v: dict[str, mp.mpf], wi: list[mp.mpf], wo: list[mp.mpf]) -> float:
    """How much the roundings of the directions are amplified: |d ln f / d input|, where the arithmetic cannot help it.

    That is |c dF/dc / F| at c = h.wo where F is little but (1 - c)^5, and what reference.CONDITION says of the model.
    """
    own = float(entry(reference.CONDITION, choice)(v, wi, wo))
    if "f0" not in v or "kd" in v:
        return own
    c = reference.half_vector(wi, wo).cos_d
    f = reference.schlick(v["f0"], c)
    return own + (float(5 * (1 - v["f0"]) * c * max(1 - c, mp.mpf(0)) ** 4 / f) if f else 0.0)


def check_values(choice: bc.Model, values: dict[str, torch.Tensor], wi: torch.Tensor, wo: torch.Tensor) -> None:
    """f and pdf of each pair lie within the bar of the reference; infinite or 0 only where the true number is."""
    dtype = wi.dtype
    form, v = form_of(choice), numbers(values)
    f = form.f(values, geometry(wi, wo, form.needs))[:, 0]
    pdf = form.pdf(values, geometry(wi, wo, form.pdf_needs))
    finfo = torch.finfo(dtype)
    for k in range(len(wi)):
        i, o = exact(wi[k].tolist()), exact(wo[k].tolist())
        true, q = entry(reference.VALUE, choice)(v, i, o)
        bar = ((VALUE if q <= 20 else TAIL) * max(float(q), 8) + 4 * condition(choice, v, i, o)) * EPS[dtype]
        for what, got, expected in (
            ("f", float(f[k]), true),
            ("pdf", float(pdf[k]), entry(reference.DENSITY, choice)(v, i, o)),
        ):
            where = f"{what} of {choice.name}{v} at {wi[k].tolist()}, {wo[k].tolist()}: {got!r}, true {expected}, Q {q}"
            scale = v.get(choice.scale, 1) if what == "f" else 1  # the lobe stops at the largest number before that
            if expected > finfo.max:
                assert got >= CEILING[dtype] * scale, where
            elif what == "f" and expected > scale * CEILING[dtype]:
                assert 0 < got <= expected * (1 + bar), where
            elif q > -math.log(finfo.tiny) - 4:  # the exponential itself is subnormal
                assert 0 <= got <= 2 * expected, where
            elif expected < 4 * finfo.tiny / EPS[dtype]:  # its factors may already be subnormal
                assert abs(got - expected) <= max(8 * finfo.tiny / EPS[dtype], 0), where
            else:
                error = abs(got - expected) / expected
                assert error <= bar, (
                    f"{where}, error {float(error / EPS[dtype]):.3g} eps, bar {bar / EPS[dtype]:.3g} eps"
                )


@every_dtype
@every_choice
def test_values_and_densities_of_the_search_ranges(choice, dtype):
    rng = np.random.default_rng(1)
    for _ in range(3):
        drawn = draw_values(choice, rng)
        wi, wo = lobe_pairs(material_of(choice, drawn), rng, 16, dtype)
        assert len(wi) >= 10
        check_values(choice, stored_values(choice, drawn, dtype), wi, wo)


@every_dtype
@every_choice
def test_values_and_densities_of_hard_directions(choice, dtype):
    """Grazing to 1e-12, retro, mirror, h = n exactly; whole boxes. Below FLOOR the cosine is FLOOR's, by design."""
    rng = np.random.default_rng(2)
    wi, wo = above_horizon(dtype)
    representable = (wi[:, 2] > FLOOR[dtype]) & (wo[:, 2] > FLOOR[dtype])
    wi, wo = wi[representable], wo[representable]
    for drawn in drawn_from_box(choice, rng):
        values = stored_values(choice, drawn, dtype)
        form = form_of(choice)
        nonzero = form.f(values, geometry(wi, wo, form.needs))[:, 0] > 0
        for mask, count in ((nonzero, 14), (~nonzero, 2)):
            rows = rng.permutation(np.flatnonzero(mask.numpy()))[:count]
            check_values(choice, values, wi[rows], wo[rows])


def check_gradients(choice: bc.Model, values: dict[str, torch.Tensor], wi: torch.Tensor, wo: torch.Tensor) -> None:
    """d f by directions and by natural values, each group relative to its own largest component."""
    form, v, eps = form_of(choice), numbers(values), EPS[wi.dtype]
    for k in range(len(wi)):
        if wi[k, 2] == wo[k, 2]:
            continue  # where max(ci, co) turns over there is no derivative
        w = [x[k].clone().requires_grad_() for x in (wi, wo)]
        leaves = {key: value.clone().requires_grad_() for key, value in values.items()}
        f = form.f(leaves, geometry(*w, form.needs))
        got = torch.autograd.grad(f.sum(), [*w, *leaves.values()], allow_unused=True, materialize_grads=True)
        i, o = exact(wi[k].tolist()), exact(wo[k].tolist())
        if entry(reference.KINK, choice)(v, i, o) < 16 * eps:
            continue
        formula = entry(reference.VALUE, choice)
        true, q = formula(v, i, o)
        by_direction, by_value = reference.gradient(formula, v, i, o)
        finfo = torch.finfo(wi.dtype)
        if max(map(abs, (*by_direction, *by_value.values()))) > finfo.max**0.8 or true < finfo.tiny ** (2 / 3):
            continue  # factors of the derivative overflow, or underflow, before it does
        bar = (GRADIENT * max(float(q), 8) + 8 * condition(choice, v, i, o)) * eps
        where = f"{choice.name}{v} at {wi[k].tolist()}, {wo[k].tolist()}, Q {q}"
        largest = max(map(abs, by_direction))
        floor = 16 * float(true) * eps  # a unit vector's component is known to eps, so is f
        for g, expected in zip([*got[0].tolist(), *got[1].tolist()], by_direction, strict=True):
            assert abs(g - expected) <= bar * largest + floor, f"direction {where}: {got[:2]}, true {by_direction}"
        for (key, value), g in zip(values.items(), got[2:], strict=True):
            name = key.split(".")[1]
            size = max(
                abs(by_value[name]), true / mp.mpf(float(value)) if choice.parameter[name].scale == "log" else true
            )
            assert abs(float(g) - by_value[name]) <= bar * size, f"{name} {where}: {g}, true {by_value[name]}"


@every_dtype
@every_choice
def test_gradients_of_the_search_ranges(choice, dtype):
    rng = np.random.default_rng(3)
    for _ in range(3):
        drawn = draw_values(choice, rng)
        wi, wo = lobe_pairs(material_of(choice, drawn), rng, 5, dtype)
        check_gradients(choice, stored_values(choice, drawn, dtype), wi, wo)


@every_dtype
@every_choice
def test_gradients_of_hard_directions(choice, dtype):
    rng = np.random.default_rng(4)
    wi, wo = above_horizon(dtype)
    representable = (wi[:, 2] > FLOOR[dtype]) & (wo[:, 2] > FLOOR[dtype]) & (wi[:, 2] != wo[:, 2])
    wi, wo = wi[representable], wo[representable]
    for drawn in drawn_from_box(choice, rng):
        values = stored_values(choice, drawn, dtype)
        form = form_of(choice)
        f = form.f(values, geometry(wi, wo, form.needs))[:, 0]
        higher = torch.maximum(wi[:, 2], wo[:, 2])
        for mask in (higher < 1e-11, (higher > 1e-11) & (higher < 1e-6), higher > 1e-6):
            rows = rng.permutation(np.flatnonzero((mask & (f > 1e-20)).numpy()))[:2]
            check_gradients(choice, values, wi[rows], wo[rows])
