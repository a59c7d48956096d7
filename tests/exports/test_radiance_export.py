"""Exported Radiance materials, rendered by rtrace."""

import numpy as np
import pytest
import torch
from export_cases import directions
from rtrace import frames, rendered

import brdfcore as bc
from brdfcore.exports import radiance

EXACT = 1e-5  # rtrace is of single precision


def pairs(material, count=150):
    """wi, wo and their frames; half of wi where the material reflects, none within 3 degrees of grazing."""
    rng = np.random.default_rng(11)
    wo = directions(rng, 6 * count, 0.05)
    drawn = material.sample(wo, torch.tensor(rng.uniform(0, 1, (len(wo), 3)))).detach()
    wi = torch.where(torch.tensor(rng.uniform(0, 1, (len(wo), 1)) < 0.5), drawn, directions(rng, len(wo), 0.05))
    keep = wi[:, 2] > 0.05
    wi, wo = wi[keep][:count], wo[keep][:count]
    return wi, wo, frames(rng, wi.numpy())


def traced(material, folder, wi, wo, turned):
    def written(number, x):
        path = folder / f"m{number}.rad"
        bc.export(material, "radiance", path, orientation=tuple(map(float, x)))
        return path.read_text()

    return rendered(folder, wi.numpy(), wo.numpy(), turned, written)


@pytest.mark.parametrize(
    "text",
    [
        "lambert(kd=[0.3, 0.2, 0.1]) + ward_bounded(rs=[0.05, 0.1, 0.2], a=0.1)",
        "lambert(kd=0.3) + ward_bounded(rs=[0.2, 0.3, 0.4], ax=0.6, ay=0.08)",
        "lambert(kd=[0.6, 0.2, 0])",
    ],
)
def test_exact_exports(text, tmp_path):
    material = bc.material(text)
    wi, wo, turned = pairs(material, 40)
    theirs = traced(material, tmp_path, wi, wo, turned)
    ours = material.f(wi, wo).detach().expand(-1, 3).numpy()
    np.testing.assert_allclose(theirs, ours, rtol=EXACT, atol=1e-6)


def test_a_refitted_ashik2_is_what_was_fitted(tmp_path, monkeypatch):
    """rtrace computes what the difference was stated for."""
    material = bc.material(
        "ashikhmin_shirley(nu=20, nv=200) + ashikhmin_shirley_diffuse(kd=[0.5, 0.2, 0.1], f0=ashikhmin_shirley.f0)"
    )
    text = bc.export(material, "radiance").content
    assert "void ashik2 brdf" in text
    wi, wo, turned = pairs(material)

    def written(number, x):
        return text.replace("1.0 0.0 0.0 .", f"{' '.join(map(repr, map(float, x)))} .").replace("brdf", f"m{number}")

    theirs = rendered(tmp_path, wi.numpy(), wo.numpy(), turned, written)
    at = radiance.Nodes(wi, wo, torch.ones(len(wi)), material.f(wi, wo).detach())
    np.testing.assert_allclose(theirs, radiance._f(text, at).numpy(), rtol=EXACT, atol=1e-6)
