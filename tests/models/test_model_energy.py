"""The directional albedo that each docstring claims: at most the reflectance, or where it fails and by how much.

Known answers of the papers are in test_known_answers.py; here are the bounds, over whole boxes where they hold for each
sample.
"""

import math

import numpy as np
import pytest
import torch
from albedo_quadrature import albedo, hemisphere_nodes
from model_cases import CHOICE_IDS, DTYPES, EPS, EVERY_CHOICE, draw_values, hemisphere, material_of

import brdfcore as bc
from brdfcore.geometry import from_angles

# Models that no sample weighs more than their reflectance of, so that the albedo cannot exceed it either.
POINTWISE = {
    "lambert",
    "coupled_lambert",
    "ward_neumann",
    "ashikhmin_shirley",
    "ashikhmin_premoze",
    "edwards",
    "ggx",
    "beckmann",
}


BOUNDED = [
    (choice, name)
    for choice, name in zip(EVERY_CHOICE, CHOICE_IDS, strict=True)
    if name.split("(")[0] in POINTWISE and "compensated" not in name
]


@pytest.mark.parametrize("dtype", DTYPES, ids=["float32", "float64"])
@pytest.mark.parametrize("choice", [choice for choice, _ in BOUNDED], ids=[name for _, name in BOUNDED])
def test_no_sample_weighs_more_than_the_reflectance(choice, dtype):
    """Whole boxes, from the normal to 1e-6 above the horizon."""
    rng = np.random.default_rng(91)
    whole = {name: 1.0 for name in ("kd", "ks", "rs") if name in choice.parameter}
    largest = 0.0
    for _ in range(4):
        material = material_of(choice, draw_values(choice, rng, where="box") | whole)
        wo = torch.cat([hemisphere(rng, 50), from_angles(math.pi / 2 - torch.logspace(-6, 0, 50), torch.zeros(()))])
        wo = wo.to(dtype)
        wi = material.sample(wo, torch.tensor(rng.uniform(0, 1, (100, 3)), dtype=dtype))
        largest = max(largest, float(material.weight(wi, wo).detach().max()))
    assert 0 < largest <= 1 + 64 * EPS[dtype]


def by_width(text: str, theta_deg: float, width: float) -> float:
    """Gaussian slopes beyond 6.5 widths hold exp(-42)."""
    return albedo(bc.material(text.format(width)), math.radians(theta_deg), 6.5 * width)


@pytest.mark.parametrize(
    ("text", "width", "below", "above"),
    [
        ("ward(rs=1, a={})", 0.7, 89.73, 89.75),
        ("ward(rs=1, a={})", 0.5, 89.73, 89.79),
        ("ward(rs=1, a={})", 1.0, 89.73, 89.79),
        ("ward_duer(rs=1, a={})", 0.39, 81.9, 81.93),
        ("ward_duer(rs=1, a={})", 0.3, 81.9, 82.2),
        ("ward_duer(rs=1, a={})", 0.5, 81.9, 82.2),
        ("kurt(constant, ks=1, m={}, alpha=0.25)", 0.5, 89.55, 89.65),
        ("kurt(constant, ks=1, m={}, alpha=0.5)", 0.5, 79.7, 79.8),
    ],
)
def test_the_angle_from_which_the_albedo_exceeds_the_reflectance(text, width, below, above):
    """As the docstrings state it; measured with this quadrature."""
    assert by_width(text, below, width) < 1 < by_width(text, above, width)


@pytest.mark.parametrize(("m", "largest"), [(1.85, 0.988), (1.9, 1.007), (2.0, 1.046), (10.0, 4.47)])
def test_kurt_plausible_exceeds_its_reflectance_from_a_width_of_1_9(m, largest):
    albedos = [by_width("kurt_plausible(constant, ks=1, m={})", theta, m) for theta in (0, 60, 85, 89.9, 89.999)]
    assert max(albedos) == pytest.approx(largest, abs=6e-3 * largest)


def over_angles(text: str, thetas: tuple[float, ...] = (0, 30, 60, 80, 89)) -> list[float]:
    """Albedos of a smooth material."""
    wi, weight = hemisphere_nodes(120, 160)
    f = [
        bc.material(text).f(wi, from_angles(*torch.tensor([math.radians(t), 0.4], dtype=torch.float64)))[:, 0]
        for t in thetas
    ]
    return [float((values * wi[:, 2] * weight).sum().detach()) for values in f]


@pytest.mark.parametrize("n", [1, 2, 5, 30, 100])
def test_blinn_phong_reflects_less_than_its_reflectance(n):
    albedos = over_angles(f"blinn_phong(ks=1, n={n})")
    assert max(albedos) == albedos[0] < 1


@pytest.mark.parametrize("c", [(-1, -1), (1, 1), (-1, 1), (-0.3, 0.8)])
@pytest.mark.parametrize("n", [1, 5, 80])
def test_lafortune_reflects_at_most_its_reflectance_where_no_factor_exceeds_1(n, c):
    albedos = over_angles(f"lafortune(ks=1, cx={c[0]}, cy={c[1]}, n={n})")
    assert max(albedos) == albedos[0] == pytest.approx(1, rel=1e-12)


def test_lafortune_has_no_bound_beyond():
    """24 at 75 degrees for factors of -1.05 and n = 100; and about the n-th power of their peak."""
    (got,) = over_angles("lafortune(ks=1, cx=-1.05, cy=-1.05, n=100)", (75,))
    assert got == pytest.approx(23.8, abs=0.1)
    peak2 = (1.05**2 - 1) * math.sin(math.radians(75)) ** 2 + 1
    (more,) = over_angles("lafortune(ks=1, cx=-1.05, cy=-1.05, n=140)", (75,))
    assert more / got == pytest.approx(peak2**20, rel=0.05)


@pytest.mark.parametrize("sigma", [0.1, 0.2, 0.32, 0.33, 0.6, math.pi / 2])
def test_qualitative_oren_nayar_exceeds_kd_at_grazing_where_little_rough(sigma):
    """Its docstring: A at normal incidence, A + B/2 at grazing, which exceeds 1 below sigma = 0.326, by 1.5 % at 0.2.

    Analytic (Portsmouth, Kutz and Hill 2025): A + B/pi (s (t - s c) + 2/3 s/c (1 - s^3)) at an angle t.
    """
    a, b = 1 - 0.5 * sigma**2 / (sigma**2 + 0.33), 0.45 * sigma**2 / (sigma**2 + 0.09)
    normal, grazing = over_angles(f"oren_nayar(kd=1, sigma={sigma})", (0, 89.9))
    assert normal == pytest.approx(a, rel=1e-9)
    assert grazing == pytest.approx(a + b / 2, rel=2e-3)
    assert (a + b / 2 > 1) == (sigma < 0.326)
    assert (grazing > 1) == (sigma < 0.325)
    if sigma == 0.2:
        assert grazing == pytest.approx(1.015, abs=5e-4)
