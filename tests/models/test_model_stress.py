"""No NaN in any value or gradient, exact zeros below the horizon, infinity only where the true number overflows."""

import pytest
import torch
from model_cases import (
    CHOICE_IDS,
    DTYPES,
    EPS,
    EVERY_CHOICE,
    above_horizon,
    corners,
    form_of,
    material_of,
    not_above_horizon,
)
from torch.func import grad, vmap

import brdfcore as bc
from brdfcore.geometry import geometry
from brdfcore.hard_cases.truth import truth

every_choice = pytest.mark.parametrize("choice", EVERY_CHOICE, ids=CHOICE_IDS)
every_dtype = pytest.mark.parametrize("dtype", DTYPES, ids=["float32", "float64"])


def over_corners(choice: bc.Model, dtype: torch.dtype) -> dict[str, torch.Tensor]:
    """The values of every corner of the box at once, each (corners,)."""
    materials = [material_of(choice, corner).values() for corner in corners(choice)]
    return {key: torch.stack([values[key].detach().to(dtype) for values in materials]) for key in materials[0]}


def per_pair(choice: bc.Model, quantity: str, values, wi, wo):
    """The quantity and its gradients by (values, wi, wo), of each corner and each pair on its own."""
    form = form_of(choice)
    evaluate, needs = (form.f, form.needs) if quantity == "f" else (form.pdf, form.pdf_needs)

    def one(values, wi, wo):
        return evaluate(values, geometry(wi, wo, needs)).sum()

    pairs, both = (None, 0, 0), (0, None, None)
    value = vmap(vmap(one, in_dims=pairs), in_dims=both)(values, wi, wo)
    slopes = vmap(vmap(grad(one, argnums=(0, 1, 2)), in_dims=pairs), in_dims=both)(values, wi, wo)
    return value, {**slopes[0], "wi": slopes[1], "wo": slopes[2]}


def first_bad(bad: torch.Tensor, values, wi, wo) -> str:
    """The corner and pair of the first offence, for the failure's message."""
    while bad.ndim > 2:
        bad = bad.any(-1)
    corner, pair = (int(k) for k in bad.nonzero()[0])
    shown = ", ".join(f"{key}={value[corner].item():g}" for key, value in values.items())
    return f"{int(bad.sum())} of {bad.numel()}, first: {shown}, wi={wi[pair].tolist()}, wo={wo[pair].tolist()}"


@pytest.mark.parametrize("quantity", ["f", "pdf"])
@every_dtype
@every_choice
def test_no_value_and_no_gradient_is_nan(choice, dtype, quantity):
    """Above the horizon; at and below it the next test asks for more."""
    values = over_corners(choice, dtype)
    wi, wo = above_horizon(dtype)
    value, slopes = per_pair(choice, quantity, values, wi, wo)
    assert not value.isnan().any(), f"{quantity}: {first_bad(value.isnan(), values, wi, wo)}"
    assert bool((value >= 0).all()), f"{quantity} < 0: {first_bad(value < 0, values, wi, wo)}"
    for key, slope in slopes.items():
        assert not slope.isnan().any(), f"d {quantity}/d {key}: {first_bad(slope.isnan(), values, wi, wo)}"


@pytest.mark.parametrize("quantity", ["f", "pdf"])
@every_dtype
@every_choice
def test_at_and_below_the_horizon_everything_is_exactly_zero(choice, dtype, quantity):
    values = over_corners(choice, dtype)
    value, slopes = per_pair(choice, quantity, values, *not_above_horizon(dtype))
    assert bool((value == 0).all())
    for key, slope in slopes.items():
        assert bool((slope == 0).all()), key


@every_dtype
@every_choice
def test_a_value_is_infinite_only_where_the_true_number_overflows(choice, dtype):
    values = over_corners(choice, dtype)
    wi, wo = above_horizon(dtype)
    form = form_of(choice)
    f = vmap(lambda v: form.f(v, geometry(wi, wo, form.needs))[:, 0])(values)
    pdf = vmap(lambda v: form.pdf(v, geometry(wi, wo, form.pdf_needs)))(values)
    for what, got in (("f", f), ("density", pdf)):
        infinite = got.isinf().nonzero().tolist()
        for corner, pair in infinite[:: max(1, len(infinite) // 20)]:
            v = {key.split(".")[1]: float(value[corner]) for key, value in values.items()}
            true = getattr(truth(choice, v, wi[pair].tolist(), wo[pair].tolist(), EPS[dtype]), what)
            assert true > torch.finfo(dtype).max, f"{what} at {v}, {wi[pair].tolist()}, {wo[pair].tolist()}: {true}"


@every_dtype
@every_choice
def test_weights_are_never_nan(choice, dtype):
    wi, wo = (torch.cat(both) for both in zip(above_horizon(dtype), not_above_horizon(dtype), strict=True))
    for corner in corners(choice):
        weight = material_of(choice, corner).weight(wi, wo)
        assert not weight.isnan().any(), corner
        assert bool((weight >= 0).all()), corner


@pytest.mark.parametrize(
    "text",
    [
        "lambert + ward",
        "lambert(kd=0.175 - ward_bounded.rs) + ward_bounded(rs=0.05, a=0.0001)",
        "coupled_lambert(f0=kurt.f0) + kurt(m=0.0001, alpha=1, f0=0)",
        "ashikhmin_shirley(n=1000000, f0=1) + ashikhmin_shirley_diffuse(f0=ashikhmin_shirley.f0)",
        "lambert(kd=0) + kurt_plausible(ks=0)",
        "lambert(kd=[0, 0.5, 1]) + kurt(ks=[1, 0, 0.5], m=10, alpha=0) + kurt(ks=[0, 1, 0], m=0.0001)",
    ],
)
@every_dtype
def test_sums_are_finite_wherever_their_terms_are(text, dtype):
    """A sum is one matrix product; a term that is 0 or infinite must not turn the others into NaN."""
    material = bc.material(text)
    wi, wo = (
        torch.cat(both).requires_grad_() for both in zip(above_horizon(dtype), not_above_horizon(dtype), strict=True)
    )
    f = material.f(wi, wo)
    assert not f.isnan().any(), f.isnan().nonzero()[0].tolist()
    assert not material.pdf(wi, wo).isnan().any()
    finite = f.isfinite().all(-1)
    gradients = torch.autograd.grad(f[finite].clamp(max=1.0).sum(), [wi, wo, *material.parameters()], allow_unused=True)
    for gradient in gradients:
        assert gradient is None or not gradient.isnan().any()
