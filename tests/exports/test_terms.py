"""The equations that shaders are generated from are the models': values, densities and samples, in both dialects."""

import re

import numpy as np
import pytest
import torch
from export_cases import CHOICES, FIRST, directions, glsl_f, material_of

import brdfcore as bc
from brdfcore.errors import InvalidValueError
from brdfcore.exports._shader import Shader
from brdfcore.exports._terms import term_source

SAME = 2e-11  # relative: the series of log1p, times the exponents of narrow lobes
STEEP = 1e-4  # cosine down to which values agree; below 1e-6 a shader evaluates at 1e-6


def pairs(material: bc.Material, seed: int, count: int = 400) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """wi, wo, u: wi from the material's own samples and anywhere, both directions some way above the horizon."""
    rng = np.random.default_rng(seed)
    wo, anywhere = directions(rng, count, STEEP), directions(rng, count, STEEP)
    u = torch.tensor(rng.uniform(0, 1, (count, 3)))
    wi = torch.where(torch.tensor(rng.uniform(0, 1, (count, 1)) < 0.6), material.sample(wo, u).detach(), anywhere)
    above = wi[:, 2] > STEEP
    return wi[above], wo[above], u[above]


@pytest.mark.parametrize("coloured", [True, pytest.param(False, marks=pytest.mark.full)])
@pytest.mark.parametrize("choice", CHOICES)
def test_values_are_the_models(choice, coloured):
    material = material_of(choice, coloured=coloured)
    shader = Shader(material)
    wi, wo, _ = pairs(material, 1)
    expected, found = material.f(wi, wo).detach(), shader.f(wi, wo)
    lit = expected > 1e-12 * expected.max()
    assert lit.float().mean() > 0.3
    torch.testing.assert_close(found[lit], expected[lit], rtol=SAME, atol=0)
    below = wi * torch.tensor([1.0, 1.0, -1.0])
    assert not shader.f(below, wo).any()
    assert not shader.f(wi, wo * torch.tensor([1.0, 1.0, -1.0])).any()


@pytest.mark.parametrize("choice", FIRST)
def test_densities_and_samples_are_the_models(choice):
    """Beckmann's lobe alone is sampled otherwise: by the slopes of all its normals, as Ward's is."""
    material = material_of(choice)
    shader = Shader(material)
    if choice.name == "beckmann":
        widths = ", ".join(f"{key.split('.')[1]}={v.item()!r}" for key, v in material.values().items() if ".a" in key)
        material = bc.material(f"ward({widths})")
    wi, wo, u = pairs(material, 2)
    expected, found = material.pdf(wi, wo).detach(), shader.pdf(wi, wo)
    lit = expected > 1e-12 * expected.max()
    torch.testing.assert_close(found[lit], expected[lit], rtol=SAME, atol=0)
    torch.testing.assert_close(shader.sample(wo, u), material.sample(wo, u).detach(), rtol=0, atol=1e-10)


@pytest.mark.parametrize("choice", FIRST)
def test_glsl_is_the_same_arithmetic(choice, unmeasured):
    """The GLSL text, read as Python by its own few rules, computes what the model does."""
    material = material_of(choice, coloured=True)
    text = bc.export(material, "brdf_explorer").content
    wi, wo, _ = pairs(material, 3, 40)
    expected = material.f(wi, wo).detach().expand(-1, 3).numpy()
    found = np.array([glsl_f(text, i, o) for i, o in zip(wi.tolist(), wo.tolist(), strict=True)])
    # its error function is good to 1.5e-7
    np.testing.assert_allclose(found, expected, rtol=1e-6 if choice.name == "beckmann" else SAME, atol=1e-200)


@pytest.mark.parametrize("choice", FIRST)
def test_single_precision_has_no_nan(choice):
    """Shaders run in single precision: from the normal to the horizon, at the ends of the box."""
    heights = [1e-30, 1e-6, 1e-3, 0.5, 1.0]
    w = torch.tensor([[np.sqrt(1 - min(h, 1.0) ** 2) * s, 0.0, h] for h in heights for s in (1.0, -1.0)])
    wi, wo = (x.reshape(-1, 3).float() for x in torch.broadcast_tensors(w[:, None], w[None]))
    for end in ("low", "high"):
        values = {f"{choice.name}.{p.name}": getattr(p, end) for p in choice.parameters}
        shader = Shader(bc.Material(material_of(choice).form, values))
        assert not shader.f(wi, wo).isnan().any()
        assert not shader.pdf(wi, wo).isnan().any()


def test_several_terms_and_ties():
    material = bc.material(
        "coupled_lambert(kd=[0.3, 0.2, 0.1], f0=kurt.f0) + kurt(ks=0.4, mx=0.1, my=0.3) + kurt(ks=0.2, m=0.5, f0=0.1)"
        " + lambert(kd=[0.5, 0.4, 0.3] - coupled_lambert.kd)"
    )
    wi, wo, u = pairs(material, 4)
    shader = Shader(material)
    torch.testing.assert_close(shader.f(wi, wo), material.f(wi, wo).detach(), rtol=SAME, atol=0)
    torch.testing.assert_close(shader.pdf(wi, wo), material.pdf(wi, wo).detach(), rtol=SAME, atol=0)
    torch.testing.assert_close(shader.sample(wo, u), material.sample(wo, u).detach(), rtol=0, atol=1e-10)
    text = bc.export(material, "brdf_explorer").content
    found = np.array([glsl_f(text, i, o) for i, o in zip(wi[:20].tolist(), wo[:20].tolist(), strict=True)])
    np.testing.assert_allclose(found, material.f(wi[:20], wo[:20]).detach(), rtol=SAME)


def test_every_model_has_a_source_or_says_why_not():
    for model in bc.MODELS.values():
        for choice in model.choices():
            if "compensated" in choice.options:
                with pytest.raises(
                    InvalidValueError, match=re.escape("got compensated, which needs a table. Export it")
                ):
                    term_source(choice)
            else:
                assert term_source(choice).bases
