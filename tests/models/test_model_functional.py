"""The Form's functions under torch.func, and the Material's through functional_call: batches come through vmap."""

import numpy as np
import pytest
import torch
from model_cases import CHOICE_IDS, EVERY_CHOICE, draw_values, form_of, hemisphere, lobe_pairs, material_of
from torch.func import functional_call, grad, hessian, jacfwd, jacrev, vmap

import brdfcore as bc
from brdfcore.geometry import Geometry, geometry

every_choice = pytest.mark.parametrize("choice", EVERY_CHOICE, ids=CHOICE_IDS)
TIED = "coupled_lambert(kd=[0.1, 0.2, 0.3], f0=kurt.f0) + kurt(mx=0.1, my=0.3) + lambert(kd=0.5 - kurt.ks)"


def batch_of(choice: bc.Model, count: int, channels: int) -> tuple[list[bc.Material], dict[str, torch.Tensor]]:
    """Materials, and their values stacked along a new first axis."""
    rng = np.random.default_rng(61)
    materials = [material_of(choice, draw_values(choice, rng, where="mild", channels=channels)) for _ in range(count)]
    values = [{key: value.detach() for key, value in m.values().items()} for m in materials]
    return materials, {key: torch.stack([v[key] for v in values]) for key in values[0]}


@pytest.mark.parametrize("channels", [0, 3], ids=["gray", "rgb"])
@every_choice
def test_vmap_over_values_equals_a_loop(choice, channels):
    materials, values = batch_of(choice, 4, channels)
    form = form_of(choice)
    wi, wo = lobe_pairs(materials[0], np.random.default_rng(62), 20)
    g = geometry(wi, wo, form.needs | form.pdf_needs)
    f, pdf = vmap(form.f, in_dims=(0, None))(values, g), vmap(form.pdf, in_dims=(0, None))(values, g)
    for k, material in enumerate(materials):
        assert torch.allclose(f[k], material.f(wi, wo).detach(), rtol=1e-13, atol=0)
        assert torch.allclose(pdf[k], material.pdf(wi, wo).detach(), rtol=1e-13, atol=0)
    u = torch.rand(20, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(1))
    samples = vmap(form.sample, in_dims=(0, None, None))(values, wo, u)
    for k, material in enumerate(materials):
        assert torch.allclose(samples[k], material.sample(wo, u).detach(), rtol=1e-13, atol=1e-14)


@every_choice
def test_vmap_over_geometry_equals_a_batch(choice):
    materials, _ = batch_of(choice, 1, 3)
    form, values = form_of(choice), materials[0].values()
    wi, wo = lobe_pairs(materials[0], np.random.default_rng(63), 20)
    expected = materials[0].f(wi, wo)
    by_pair = vmap(lambda wi, wo: form.f(values, geometry(wi, wo, form.needs)))(wi, wo)
    assert torch.allclose(by_pair, expected, rtol=1e-13, atol=0)
    g = geometry(wi, wo, form.needs)
    kept = Geometry(*(value for value in g))
    assert torch.allclose(form.f(values, kept), expected, rtol=1e-13, atol=0)


@every_choice
def test_forward_and_reverse_jacobians_agree(choice):
    materials, values = batch_of(choice, 1, 3)
    form = form_of(choice)
    values = {key: value[0] for key, value in values.items()}
    wi, wo = lobe_pairs(materials[0], np.random.default_rng(64), 10)
    g = geometry(wi, wo, form.needs | form.pdf_needs)
    for function in (form.f, form.pdf):
        forward, reverse = jacfwd(function)(values, g), jacrev(function)(values, g)
        for key in values:
            assert forward[key].shape == reverse[key].shape
            assert torch.allclose(forward[key], reverse[key], rtol=1e-11, atol=1e-11)


@every_choice
def test_vmapped_forward_jacobians(choice):
    """What the fits use: vmap(jacfwd) over a batch of starts."""
    materials, values = batch_of(choice, 3, 3)
    form = form_of(choice)
    wi, wo = lobe_pairs(materials[0], np.random.default_rng(65), 8)
    g = geometry(wi, wo, form.needs)
    together = vmap(jacfwd(form.f), in_dims=(0, None))(values, g)
    for k in range(3):
        alone = jacfwd(form.f)({key: value[k] for key, value in values.items()}, g)
        for key in values:
            assert torch.allclose(together[key][k], alone[key], rtol=1e-12, atol=1e-13)


@every_choice
def test_jacobians_by_direction(choice):
    materials, _ = batch_of(choice, 1, 0)
    form, values = form_of(choice), {k: v.detach() for k, v in materials[0].values().items()}
    wi, wo = lobe_pairs(materials[0], np.random.default_rng(66), 5)

    def f(wi, wo):
        return form.f(values, geometry(wi, wo, form.needs))[0]

    for argument in (0, 1):
        forward = vmap(jacfwd(f, argnums=argument))(wi, wo)
        reverse = vmap(grad(f, argnums=argument))(wi, wo)
        assert torch.allclose(forward, reverse, rtol=1e-11, atol=1e-11)


def test_hessians_of_a_tied_material():
    form = bc.material(TIED).form
    values = {key: value.detach() for key, value in bc.material(TIED).values().items()}
    rng = np.random.default_rng(67)
    g = geometry(hemisphere(rng, 5), hemisphere(rng, 5), form.needs)
    second = hessian(lambda v: form.f(v, g).log1p().sum())(values)
    for one, other in ((a, b) for a in values for b in values):
        assert second[one][other].isfinite().all()
        flipped = second[other][one]
        if second[one][other].ndim == 2:
            flipped = flipped.T
        assert torch.allclose(second[one][other], flipped.reshape(second[one][other].shape), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("text", [TIED, "lambert", "ashikhmin_shirley(nu=10, nv=100) + lambert(kd=[0.1, 0.2])"])
def test_functional_call_replaces_the_stored_values(text):
    material = bc.material(text)
    rng = np.random.default_rng(68)
    wi, wo = hemisphere(rng, 10), hemisphere(rng, 10)
    before = material.f(wi, wo)
    changed = {name: p.detach() * 0.9 for name, p in material.named_parameters()}
    got = functional_call(material, changed, (wi, wo))
    assert torch.equal(material.f(wi, wo), before)
    other = bc.material(text)
    other.load_state_dict(changed)
    assert torch.equal(got, other.f(wi, wo))


@pytest.mark.parametrize("text", [TIED, "ward(ax=0.1, ay=0.2)"])
def test_functional_call_under_vmap_and_jacfwd(text):
    material = bc.material(text)
    rng = np.random.default_rng(69)
    wi, wo = hemisphere(rng, 6), hemisphere(rng, 6)
    stored = {name: p.detach() for name, p in material.named_parameters()}
    starts = {name: torch.stack([value, value * 0.95]) for name, value in stored.items()}

    def f(stored):
        return functional_call(material, stored, (wi, wo))

    batch = vmap(f)(starts)
    slopes = vmap(jacfwd(f))(starts)
    for k in range(2):
        one = {name: value[k] for name, value in starts.items()}
        assert torch.allclose(batch[k], f(one), rtol=1e-13, atol=0)
        alone = jacrev(f)(one)
        for name in stored:
            assert torch.allclose(slopes[name][k], alone[name], rtol=1e-10, atol=1e-12)
