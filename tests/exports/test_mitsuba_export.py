"""Exported Mitsuba plugins, run by Mitsuba: values with the cosine, densities, samples and their weights.

scalar_rgb computes in double precision between directions and colours of single precision.
"""

import numpy as np
import pytest
import torch
from export_cases import CHOICES, directions, material_of

import brdfcore as bc
from brdfcore.exports._shader import Shader

mitsuba = pytest.importorskip("mitsuba", reason="needs the renderer Mitsuba 3: pip install -e '.[peers]'")

EXACT = 1e-5


@pytest.fixture
def loaded(tmp_path):
    """The BSDF of a material, from the file that is written for it."""

    def load(material, name):
        mitsuba.set_variant("scalar_rgb")
        path = tmp_path / f"{name}.py"
        bc.export(material, "mitsuba", path)
        exec(compile(path.read_text(), str(path), "exec"), {"__name__": name})
        return mitsuba.load_dict({"type": name})

    return load


def check(material, bsdf, count):
    rng = np.random.default_rng(5)
    wo = directions(rng, count, 0.02).float()
    anywhere = directions(rng, count, 0.02).float()
    u = torch.tensor(rng.uniform(0, 1, (count, 3))).float()
    shader = Shader(material)
    wi = torch.where(u[:, :1] < 0.7, shader.sample(wo, u.roll(1, -1)), anywhere)
    wi = torch.nn.functional.normalize(wi, dim=-1)
    keep = wi[:, 2] > 0.02
    wi, wo, u = wi[keep], wo[keep], u[keep]
    given = wi.double(), wo.double()
    expected = (material.f(*given) * given[0][:, 2:]).detach().expand(-1, 3).numpy()
    density = shader.pdf(*given).numpy()
    context, si = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f()
    got, pdfs = [], []
    for incident, seen, numbers in zip(wi.tolist(), wo.tolist(), u.tolist(), strict=True):
        si.wi = mitsuba.Vector3f(*seen)
        value, pdf = bsdf.eval_pdf(context, si, mitsuba.Vector3f(*incident))
        got.append(list(value))
        pdfs.append(pdf)
        drawn, weight = bsdf.sample(context, si, numbers[0], mitsuba.Point2f(numbers[1:]))
        if drawn.wo.z > 0 and drawn.pdf > 0:
            again = list(bsdf.eval(context, si, drawn.wo))
            np.testing.assert_allclose(np.array(list(weight)) * drawn.pdf, again, rtol=1e-5, atol=1e-30)
            assert drawn.pdf == pytest.approx(bsdf.pdf(context, si, drawn.wo), rel=1e-5)
    lit = expected > 1e-9 * expected.max()
    assert len(expected) > count / 3
    np.testing.assert_allclose(np.array(got)[lit], expected[lit], rtol=EXACT)
    np.testing.assert_allclose(pdfs, density, rtol=EXACT, atol=1e-9 * density.max())


@pytest.mark.parametrize("choice", CHOICES)
def test_every_model(choice, loaded, unmeasured):
    material = material_of(choice, coloured=True)
    check(material, loaded(material, f"one_{abs(hash(choice))}"), 30)


def test_a_material_of_several_terms(loaded):
    material = bc.material(
        "coupled_lambert(kd=[0.3, 0.2, 0.1], f0=kurt.f0) + kurt(ks=0.4, mx=0.1, my=0.3) + ggx(ks=0.1, a=0.3)"
    )
    bsdf = loaded(material, "several")
    check(material, bsdf, 150)
    context, si = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f()
    up, down = mitsuba.Vector3f(0.6, 0, 0.8), mitsuba.Vector3f(0.6, 0, -0.8)
    for wi, wo in ((up, down), (down, up), (down, down)):
        si.wi = wi
        assert not any(bsdf.eval(context, si, wo))
        assert bsdf.pdf(context, si, wo) == 0


def test_the_density_integrates_to_what_is_not_lost(loaded):
    """Over the hemisphere, by samples of the cosine, to 2 %; and the weights' mean is the albedo."""
    material = bc.material("lambert(kd=0.4) + ward_bounded(rs=0.4, ax=0.3, ay=0.5)")
    bsdf = loaded(material, "whole")
    context, si = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f()
    si.wi = mitsuba.Vector3f(0.6, 0, 0.8)
    rng = np.random.default_rng(9)
    wi = directions(rng, 4000).numpy()
    mass = 2 * np.pi * np.mean([bsdf.pdf(context, si, mitsuba.Vector3f(*w)) for w in wi])
    weights, inside = [], []
    for u in torch.quasirandom.SobolEngine(3, scramble=True, seed=1).draw(4096).tolist():
        drawn, weight = bsdf.sample(context, si, u[0], mitsuba.Point2f(u[1:]))
        weights.append(weight[0])
        inside.append(drawn.wo.z > 0)
    assert mass == pytest.approx(np.mean(inside), rel=0.03)
    albedo = bc.albedo(material, torch.acos(torch.tensor(0.8))).values.item()
    assert np.mean(weights) == pytest.approx(albedo, rel=0.01)


def test_a_coloured_plugin_says_which_variants_it_runs_in(tmp_path):
    path = tmp_path / "coloured.py"
    bc.export(bc.material("lambert(kd=[0.1, 0.2, 0.3])"), "mitsuba", path)
    gray = tmp_path / "gray.py"
    bc.export(bc.material("lambert(kd=0.3)"), "mitsuba", gray)
    mitsuba.set_variant("scalar_spectral")
    try:
        exec(compile(gray.read_text(), str(gray), "exec"), {})
        si = mitsuba.SurfaceInteraction3f()
        si.wi = mitsuba.Vector3f(0, 0, 1)
        value = mitsuba.load_dict({"type": "gray"}).eval(mitsuba.BSDFContext(), si, mitsuba.Vector3f(0.6, 0, 0.8))
        assert list(value) == pytest.approx([0.3 / np.pi * 0.8] * 4)
        with pytest.raises(ImportError, match="Expected a variant with RGB colours, got scalar_spectral"):
            exec(compile(path.read_text(), str(path), "exec"), {})
    finally:
        mitsuba.set_variant("scalar_rgb")
