"""What single scattering loses, as tabulated, and the lobes that return it."""

import math
import re

import numpy as np
import pytest
import torch
from model_cases import hemisphere

import brdfcore as bc
from brdfcore.energy import lost_energy
from brdfcore.errors import ModelTextError
from brdfcore.fitting.plan import plan
from brdfcore.geometry import from_angles, geometry
from brdfcore.models import _compensation

LOBES = [(name, word) for name in ("ggx", "beckmann") for word in ("correlated", "separable")]
CLAIMED = 2e-5  # of ks: how far from it the models' docstrings let the albedo be where F = 1
WIDTHS = (1e-4, 0.01, 0.2, 1.0)
ANGLES = (0.0, 30.0, 60.0, 85.0, 89.0)

every_lobe = pytest.mark.parametrize(("name", "word"), LOBES, ids=[f"{n}-{w}" for n, w in LOBES])


def double(x: float) -> torch.Tensor:
    return torch.tensor(x, dtype=torch.float64)


def model_of(name: str, word: str):
    return bc.MODELS[name](("isotropic", word, "constant", "compensated"))


# --- the table -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["ggx", "beckmann"])
def test_the_generators_quadrature_has_converged(name):
    for a, mu in ((1e-4, 1e-3), (0.01, 0.02), (0.3, 1e-3), (0.3, 0.7), (3.0, 1e-4), (10.0, 0.5)):
        for coarse, fine in zip(lost_energy.lost(name, a, mu), lost_energy.lost(name, a, mu, 14, 2.5), strict=True):
            assert coarse == pytest.approx(fine, rel=1e-6, abs=5e-6)


def test_the_energy_that_is_lost_at_normal_incidence_for_a_width_of_1():
    """GGX's D is 1/pi there, and the albedo the integral of c/(1 + c) dc, 1 - ln 2 (analytic)."""
    assert lost_energy.lost("ggx", 1.0, 1.0) == pytest.approx((math.log(2), math.log(2)), abs=1e-8)


@every_lobe
def test_the_table_is_what_the_generator_computes(name, word):
    model, rng = model_of(name, word), np.random.default_rng(101)
    column = ("correlated", "separable").index(word)
    errors = []
    for _ in range(25):
        a, mu = 10 ** rng.uniform(-4, 1), rng.uniform()
        mu = min(1.0, 10 * a * mu) if rng.uniform() < 0.5 else mu
        errors.append(float(model.lost(double(mu), double(a))) - lost_energy.lost(name, a, mu)[column])
    assert np.abs(errors).max() <= CLAIMED
    assert np.sqrt(np.mean(np.square(errors))) <= 5e-6


@every_lobe
def test_entries_of_the_file_are_made_again(name, word):
    """The spline goes through the values at its sites."""
    model, column = model_of(name, word), ("correlated", "separable").index(word)
    coefficients = _compensation.coefficients(model.table_name)
    assert coefficients.shape == (lost_energy.WIDTHS, lost_energy.COSINES)
    assert bool((coefficients > 0).all())
    x, y = lost_energy._sites(lost_energy.COSINES), lost_energy._sites(lost_energy.WIDTHS)
    for i, j in ((3, 5), (58, 62)):
        a = lost_energy.width_at(float(y[i]))
        mu = lost_energy.cosine_at(float(x[j]), a)
        energy = lost_energy.lost(name, a, mu)[column]
        assert float(model.lost(double(mu), double(a))) == pytest.approx(energy, rel=2e-6)


@every_lobe
def test_the_mean_is_an_accurate_quadrature_of_the_table(name, word):
    model = model_of(name, word)
    for a in (1e-4, 0.03, 1.0, 10.0):
        u = torch.linspace(0, 1, 40_001, dtype=torch.float64)
        scale = float(_compensation.rise(double(a)))
        mu = scale * torch.expm1(u * math.log1p(1 / scale))
        total = torch.trapezoid(2 * mu * model.lost(mu, double(a)), mu)
        assert float(model.mean_lost(double(a))) == pytest.approx(float(total), rel=1e-6)


# --- the lobes -------------------------------------------------------------------------------------------------------


@every_lobe
def test_the_white_furnace(name, word):
    """f0 = 1: every angle to 89 degrees reflects all, for widths up to 1."""
    theta = torch.tensor(ANGLES).double().deg2rad()
    for a in WIDTHS:
        material = bc.material(f"{name}(isotropic, {word}, compensated, ks=1, f0=1, a={a})")
        with torch.no_grad():
            albedo = bc.albedo(material, theta).values[:, 0]
        assert float((albedo - 1).abs().max()) <= CLAIMED, (a, albedo)


@every_lobe
def test_the_white_furnace_over_the_whole_box(name, word):
    """By the generator's quadrature of what one facet reflects, and an integral of what is returned."""
    column = ("correlated", "separable").index(word)
    model = model_of(name, word)
    for a in (1e-4, 0.02, 2.5, 10.0):
        mu, weight = _compensation.cosines(double(a))
        values = {"ks": double(1.0), "a": double(a)}
        for co in (1e-3, 0.02, 0.3, 1.0):
            back = model.lost(mu, double(a)) * model.lost(double(co), double(a)) / model.mean_lost(double(a))
            returned = float((back * weight).sum())
            assert float(model.returned_albedo(values, double(co))) == pytest.approx(returned, rel=1e-9)
            assert 1 - lost_energy.lost(name, a, co)[column] + returned == pytest.approx(1, abs=CLAIMED)


FRESNEL = ["schlick, f0=0.3", "constant", "dielectric, eta=1.5", "conductor, eta=[0.2, 0.9, 1.1], k=[3.9, 2.4, 2.2]"]


@pytest.mark.parametrize("fresnel", FRESNEL)
@every_lobe
def test_no_more_is_reflected_than_is_received(name, word, fresnel):
    theta = torch.tensor((0.0, 60.0, 85.0)).double().deg2rad()
    for a in (0.05, 1.0):
        text = f"{name}(isotropic, {word}, {{}}, {fresnel}, ks=1, a={a})"
        with torch.no_grad():
            single, whole = (bc.albedo(bc.material(text.format(w)), theta).values for w in ("single", "compensated"))
        assert bool((whole <= 1 + CLAIMED).all())
        assert bool((whole >= single).all())
        assert float((whole - single).max()) > 1e-5


def test_what_is_returned_is_the_geometric_series():
    """Each time the share Fbar is reflected; 1 - Gbar of it leaves."""
    model = bc.MODELS["ggx"](("isotropic", "correlated", "schlick", "compensated"))
    values = {"ks": double(1.0), "f0": double(0.6), "a": double(0.8)}
    factor, mean = 0.6 + 0.4 / 21, float(model.mean_lost(values["a"]))
    series = sum(factor * (1 - mean) * (factor * mean) ** bounces for bounces in range(1, 200)) / mean
    assert float(model.returned_share(values)) == pytest.approx(series, rel=1e-12)


def test_mean_fresnel_factors():
    """The cosine-weighted means of a dielectric of 1.5 (Walsh 1926) and of a perfect conductor."""
    n = 1.5
    walsh = (
        0.5
        + (n - 1) * (3 * n + 1) / (6 * (n + 1) ** 2)
        + n**2 * (n**2 - 1) ** 2 / (n**2 + 1) ** 3 * math.log((n - 1) / (n + 1))
        - 2 * n**3 * (n**2 + 2 * n - 1) / ((n**2 + 1) * (n**4 - 1))
        + 8 * n**4 * (n**4 + 1) / ((n**2 + 1) * (n**4 - 1) ** 2) * math.log(n)
    )
    assert float(_compensation.mean_fresnel({"eta": double(n)})) == pytest.approx(walsh, rel=1e-9)
    mirror = {"eta": double(0.01), "k": double(20.0)}
    assert float(_compensation.mean_fresnel(mirror)) == pytest.approx(1, abs=2e-3)


@every_lobe
def test_compensated_lobes_are_reciprocal(name, word):
    material = bc.material(f"{name}(isotropic, {word}, compensated, f0=[0.2, 0.5, 1], a=0.4)")
    rng = np.random.default_rng(102)
    wi, wo = hemisphere(rng, 200), hemisphere(rng, 200)
    assert torch.allclose(material.f(wi, wo), material.f(wo, wi), rtol=1e-13, atol=0)


@pytest.mark.parametrize("text", ["ggx({}, f0=0.3)", "beckmann({}, separable, conductor)", "ggx({}, dielectric)"])
def test_derivatives_of_compensated_lobes(text):
    material = bc.material(text.format("isotropic, compensated"))
    rng = np.random.default_rng(103)
    wi, wo = hemisphere(rng, 4), hemisphere(rng, 4)
    keys = list(material.values())

    g = geometry(wi, wo, material.form.needs)

    def f(*values: torch.Tensor) -> torch.Tensor:
        return material.form.f(dict(zip(keys, values, strict=True)), g)

    inputs = tuple(value.detach().clone().requires_grad_() for value in material.values().values())
    assert torch.autograd.gradcheck(f, inputs, eps=1e-7, atol=1e-6, rtol=1e-5)


@pytest.mark.parametrize("a", [1e-4, 0.01, 0.3, 10.0])
@every_lobe
def test_no_sample_weighs_much_more_than_ks(name, word, a):
    material = bc.material(f"{name}(isotropic, {word}, compensated, constant, ks=1, a={a})")
    u = torch.rand(2000, 3, generator=torch.Generator().manual_seed(8), dtype=torch.float64)
    for theta in (0.0, 70.0, 89.0, 89.99):
        wo = from_angles(double(math.radians(theta)), double(0.3))
        wi = material.sample(wo.expand(2000, 3), u).detach()
        weight = material.weight(wi, wo).detach()
        assert float(weight.max()) <= (3 if name == "ggx" else 11)
        assert float(weight.mean()) == pytest.approx(1, abs=0.1)


def test_the_certificate_of_a_compensated_mirror():
    found = bc.certify(bc.material("ggx(isotropic, compensated, ks=1, f0=1, a=0.3)"), tolerance=1e-3)
    assert found.energy_conserving
    assert found.reciprocal
    assert found.max_albedo == pytest.approx(1, abs=1e-3)


def test_a_narrow_lobe_evaluates_to_a_finite_number_where_the_lost_energy_underflows():
    material = bc.material("beckmann(isotropic, compensated, a=0.0001)")
    w = from_angles(torch.tensor([0.0, 0.3, 1.0]).double(), double(0.2)).requires_grad_()
    f = material.f(w, w.detach().flip(0))
    slopes = torch.autograd.grad(f.sum(), [w, *material.parameters()])
    assert all(bool(x.isfinite().all()) for x in (f, *slopes))


# --- the option ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["ggx", "beckmann"])
def test_an_anisotropic_lobe_has_no_compensation(name):
    expected = f"Expected anisotropic or compensated for {name}, got both, which do not go together. Drop one."
    for words in (("anisotropic", "compensated"), ("compensated", "separable", "anisotropic")):
        with pytest.raises(ModelTextError, match=f"^{re.escape(expected)}$") as caught:
            bc.material(f"{name}({', '.join(words)})")
        assert caught.value.field == "model"
        with pytest.raises(ModelTextError, match=f"^{re.escape(expected)}$"):
            bc.MODELS[name](words)
    assert not any({"anisotropic", "compensated"} <= set(choice.options) for choice in bc.MODELS[name].with_words(()))


def test_a_fit_keeps_a_compensated_lobe_isotropic_and_says_so():
    found = plan(1, "lambert + ggx(compensated)", azimuth_observed=True)
    assert "isotropic" in found.form.terms[1].model.options
    assert found.choices == (
        "ggx is isotropic, which compensated lobes are, though the sample's azimuth was observed.",
    )
    assert plan(1, "ggx(isotropic, compensated)", azimuth_observed=True).choices == ()
    assert plan(1, "ggx(compensated, a=0.2)", azimuth_observed=True).choices == ()
    assert plan(1, "ggx(compensated)").choices == ()


def test_with_schlick_what_is_returned_is_no_multiple_of_f0():
    """Three coefficients, the third ks: f0 shapes a basis, so the pair (ks f0, ks (1 - f0)) is not all of f."""
    model = bc.MODELS["ggx"](("isotropic", "compensated"))
    coefficients = model.coefficients({"ks": double(0.5), "f0": double(0.2)})
    assert [float(c) for c in coefficients] == pytest.approx([0.1, 0.4, 0.5])
    assert len(model.single.coefficients({"ks": double(0.5), "f0": double(0.2)})) == 2
