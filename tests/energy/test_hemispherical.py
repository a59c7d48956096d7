"""The hemispherical albedo, against exact forms and against other quadratures of the directional one."""

import math

import numpy as np
import pytest
import torch

import brdfcore as bc
from brdfcore.errors import InvalidValueError


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("lambert(kd=[0.3, 0.6])", [0.3, 0.6]),
        ("oren_nayar(energy_preserving, kd=1, sigma=0.7)", [1.0]),
        ("lambert(kd=0) + oren_nayar(energy_preserving, kd=0)", [0.0]),
    ],
)
def test_known_answers(text: str, expected: list[float]) -> None:
    found = bc.hemispherical_albedo(bc.material(text), 1e-9)
    assert found.met
    assert found.values.tolist() == pytest.approx(expected, abs=1e-9)
    assert bool((found.error <= 1e-9).all())
    assert (found.tolerance, found.method) == (1e-9, "clenshaw_curtis")


def test_ashikhmin_and_shirleys_diffuse_term() -> None:
    """The integral of 2 c kd (1 - f0) (1 - (1 - c/2)^5) over c from 0 to 1."""
    material = bc.material("ashikhmin_shirley_diffuse(kd=0.5, f0=0.2)")
    c, w = np.polynomial.legendre.leggauss(8)  # exact for this polynomial
    c, w = (c + 1) / 2, w / 2
    expected = 0.5 * 0.8 * float((w * 2 * c * (1 - (1 - c / 2) ** 5)).sum())
    assert bc.hemispherical_albedo(material, 1e-10).values.tolist() == pytest.approx([expected], abs=1e-10)


@pytest.mark.parametrize(
    ("text", "tolerance", "azimuths"),
    [
        ("lambert(kd=0.2) + ward_bounded(isotropic, rs=0.7, a=0.1)", 1e-4, 1),
        ("ward_bounded(rs=1, ax=0.1, ay=0.4)", 2e-3, 12),
        ("kurt(isotropic, constant, ks=1, m=0.3, alpha=0.25)", 1e-4, 1),  # diverges towards grazing, yet has a mean
    ],
)
def test_it_is_the_mean_of_the_directional_albedo(text: str, tolerance: float, azimuths: int) -> None:
    """By Gauss and Legendre's rule in sqrt(cos theta), and evenly in the azimuth."""
    material = bc.material(text)
    with torch.no_grad():
        found = bc.hemispherical_albedo(material, tolerance)
        x, w = np.polynomial.legendre.leggauss(14)
        s, w = torch.tensor((x + 1) / 2)[:, None], torch.tensor(w / 2)
        phi = 2 * math.pi * torch.arange(azimuths, dtype=torch.float64) / azimuths
        albedo = bc.albedo(material, torch.acos(s.square()), phi, tolerance / 4).values[..., 0].mean(1)
    expected = float((w * 4 * s[:, 0] ** 3 * albedo).sum())
    assert found.met
    assert abs(float(found.values) - expected) <= float(found.error) + tolerance / 2
    assert float(found.error) <= tolerance


def test_it_is_differentiable() -> None:
    material = bc.material("lambert(kd=0.2) + oren_nayar(kd=0.4, sigma=0.5)")
    found = bc.hemispherical_albedo(material, 1e-8)
    found.values.sum().backward()
    gradient = {name: float(p.grad) for name, p in material.named_parameters() if p.grad is not None}
    assert gradient["raw.lambert.kd"] == pytest.approx(1, abs=1e-8)

    def at(sigma: float) -> float:
        return float(bc.hemispherical_albedo(bc.material(f"oren_nayar(kd=0.4, sigma={sigma})"), 1e-10).values.detach())

    assert gradient["raw.oren_nayar.sigma"] == pytest.approx((at(0.501) - at(0.499)) / 0.002, rel=1e-4)
    assert not found.error.requires_grad


def test_a_tolerance_that_is_none_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="Expected tolerance to be above 0, got 0") as refused:
        bc.hemispherical_albedo(bc.material("lambert"), 0.0)
    assert refused.value.field == "tolerance"
