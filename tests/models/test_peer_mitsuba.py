"""Dielectric microfacet lobes and exact Fresnel factors against Mitsuba 3, which computes in single precision.

Its roughdielectric is F D G1(wi) G1(wo) / (4 ci co) where both directions are above the surface, as our separable form
is; its Beckmann G1 is Walter's rational fit. Metals: test_microfacet.py.
"""

import math

import numpy as np
import pytest
import torch
from model_cases import lobe_pairs
from test_microfacet import walters_fit

import brdfcore as bc
from brdfcore.models.fresnel import conductor, dielectric

mitsuba = pytest.importorskip("mitsuba", reason="needs the renderer Mitsuba 3: pip install -e '.[peers]'")
mitsuba.set_variant("scalar_rgb")

ETA = 1.5
SINGLE = 1e-5  # of its arithmetic, near grazing


def smiths(tangent: float) -> float:
    """Beckmann's own G1, of r = a tan theta."""
    v = 1 / tangent
    return 2 / (1 + math.erf(v) + math.exp(-v * v) / (v * math.sqrt(math.pi)))


@pytest.mark.parametrize(("ax", "ay"), [(0.3, 0.3), (0.05, 0.05), (0.4, 0.1), (0.1, 1.0)])
@pytest.mark.parametrize("name", ["ggx", "beckmann"])
def test_dielectric_lobes_are_those_of_roughdielectric(name, ax, ay):
    theirs = mitsuba.load_dict(
        {
            "type": "roughdielectric",
            "distribution": name,
            "alpha_u": ax,
            "alpha_v": ay,
            "int_ior": ETA,
            "ext_ior": 1.0,
        }
    )
    width = f"isotropic, a={ax}" if ax == ay else f"anisotropic, ax={ax}, ay={ay}"
    ours = bc.material(f"{name}({width}, separable, dielectric, ks=1, eta={ETA})")
    wi, wo = lobe_pairs(ours, np.random.default_rng(95), 150)
    keep = (wi[:, 2] > 0.02) & (wo[:, 2] > 0.02)
    wi, wo = wi[keep], wo[keep]
    f = (ours.f(wi, wo)[:, 0] * wi[:, 2]).detach().numpy()
    context, si = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f()
    expected = []
    for value, *w in zip(f.tolist(), wi.tolist(), wo.tolist(), strict=True):
        if name == "beckmann":
            for x, y, z in w:
                tangent = math.hypot(ax * x, ay * y) / z
                value *= walters_fit(tangent) / smiths(tangent)
        si.wi = mitsuba.Vector3f(*w[1])
        expected.append((list(theirs.eval(context, si, mitsuba.Vector3f(*w[0]))), value))
    assert len(expected) > 100
    got, value = np.array([e[0] for e in expected]), np.array([[e[1]] * 3 for e in expected])
    np.testing.assert_allclose(got, value, rtol=SINGLE)


def test_exact_fresnel_factors():
    """From grazing to normal incidence, for glass, diamond, gold's and silver's indices."""
    for cosine in (1e-3, 0.1, 0.5, 0.9, 1.0):
        c = torch.tensor(cosine, dtype=torch.float64)
        for eta in (1.0003, 1.33, 1.5, 2.4):
            expected = dielectric(c, torch.tensor(eta, dtype=torch.float64)).item()
            assert mitsuba.fresnel(cosine, eta)[0] == pytest.approx(expected, rel=1e-5, abs=1e-7)
        for eta, k in ((0.18, 3.4), (0.05, 4.2), (1.4, 7.6), (3.0, 3.3)):
            expected = conductor(c, *torch.tensor([eta, k], dtype=torch.float64)).item()
            index = mitsuba.Complex2f(eta, k)
            assert mitsuba.fresnel_conductor(cosine, index) == pytest.approx(expected, rel=1e-5)
