"""Directional albedos against published and closed values, their claims, and their derivatives."""

import math

import pytest
import torch

import brdfcore as bc

DEGREE = math.pi / 180


@pytest.mark.parametrize(
    ("text", "theta_deg", "expected", "accuracy"),
    [
        ("ashikhmin_shirley(f0=1, nu=10, nv=10)", 0.0, 0.69571, 5e-6),  # A&S Fig. 2: "about 68 %"
        ("kurt_plausible(ks=1, f0=1, m=0.1)", 60.0, 0.898, 5e-4),  # Kurt Fig. 2
        ("kurt_plausible(ks=1, f0=1, m=0.5)", 80.0, 0.587, 5e-4),
        ("kurt_plausible(ks=1, f0=1, m=3)", 89.9, 1.44, 5e-3),  # not plausible, as eq. 9 is said to be
        ("kurt(ks=1, f0=1, m=0.35, alpha=0.25)", 89.9, 1.11, 5e-3),
        ("ward_bounded(rs=1, a=0.1)", 88.0, 0.823, 5e-4),  # G-M&D Figs. 6, 7
        ("ward_bounded(rs=1, a=0.1)", 89.9, 0.965, 5e-4),
        ("ashikhmin_shirley_diffuse(kd=1, f0=0.05)", 60.0, 0.95 * (1 - 0.75**5), 1e-12),
        ("lambert(kd=0.3)", 89.0, 0.3, 1e-15),
    ],
)
def test_published_albedos(text, theta_deg, expected, accuracy):
    found = bc.albedo(bc.material(text), theta_deg * DEGREE, tolerance=1e-8)
    assert found.met
    assert found.values.item() == pytest.approx(expected, abs=accuracy)


@pytest.mark.parametrize(
    "text",
    [
        "ward(ax=0.05, ay=0.3)",
        "kurt(mx=0.02, my=0.5, alpha=0.1)",
        "ashikhmin_shirley(f0=0.3, nu=20, nv=400)",
        "ggx(a=0.2)",
        "beckmann(ax=0.1, ay=0.4)",
        "cook_torrance(a=0.3)",
        "lafortune(n=40)",
        "edwards(n=20)",
        "oren_nayar(sigma=0.4)",
    ],
)
def test_an_albedo_is_as_exact_as_it_claims(text):
    material = bc.material(text)
    theta = torch.tensor([0.0, 0.7, 1.3, 1.55], dtype=torch.float64)
    with torch.no_grad():
        exact = bc.albedo(material, theta, 0.4, tolerance=1e-11)
        for tolerance in (1e-3, 1e-6):
            found = bc.albedo(material, theta, 0.4, tolerance=tolerance)
            assert found.met
            assert bool((found.error <= tolerance).all())
            assert bool(((found.values - exact.values).abs() <= found.error + exact.error).all())


@pytest.mark.parametrize("text", ["ward_bounded(a=0.2)", "kurt(m=0.3)", "ggx(ax=0.2, ay=0.4, f0=0.3)"])
def test_derivatives_in_the_parameters(text):
    material = bc.material(text)
    raw = [parameter for parameter in material.parameters() if parameter.requires_grad]
    total = bc.albedo(material, 1.0, 0.3, tolerance=1e-11).values.sum()
    slopes = torch.autograd.grad(total, raw)
    for parameter, slope in zip(raw, slopes, strict=True):
        sides = []
        for step in (1e-5, -1e-5):
            with torch.no_grad():
                parameter += step
                sides.append(float(bc.albedo(material, 1.0, 0.3, tolerance=1e-12).values.sum()))
                parameter -= step
        assert float(slope) == pytest.approx((sides[0] - sides[1]) / 2e-5, rel=1e-5, abs=1e-7)


def test_angles_and_methods_that_are_none_are_refused_in_a_sentence():
    material = bc.material("ward")
    with pytest.raises(bc.errors.InvalidValueError, match=r"Expected theta to be in \[0, pi/2\), got 1\.6"):
        bc.albedo(material, 1.6)
    with pytest.raises(bc.errors.UnknownNameError, match="slope_disc"):
        bc.albedo(material, 0.5, method="slope_disk")
