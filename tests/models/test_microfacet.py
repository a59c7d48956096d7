"""The Smith microfacet lobes and the exact Fresnel factors: known answers, sampling, and another renderer's.

Walter = Walter, Marschner, Li and Torrance 2007; Heitz = Heitz 2014, "Understanding the masking-shadowing function".
"""

import math

import numpy as np
import pytest
import torch
from albedo_quadrature import hemisphere_nodes, panels
from model_cases import EPS, hemisphere, lobe_pairs
from scipy import stats

import brdfcore as bc
from brdfcore.geometry import FLOOR, from_angles, geometry
from brdfcore.hard_cases.exact import Exact, mp
from brdfcore.hard_cases.fresnel import exact_fresnel
from brdfcore.hard_cases.microfacets import beckmann_masking, ggx_masking, masking
from brdfcore.models import _fresnel_lobe
from brdfcore.models.beckmann import _visible_slope
from brdfcore.models.fresnel import conductor, dielectric

NAMES = ("ggx", "beckmann")
EXACT = Exact((mp.zero, mp.zero, mp.one), (mp.zero, mp.zero, mp.one))  # its arithmetic; the directions are not used
LAMBDA = {"ggx": ggx_masking, "beckmann": beckmann_masking}


def double(*numbers: float) -> torch.Tensor:
    return torch.tensor(numbers[0] if len(numbers) == 1 else numbers, dtype=torch.float64)


def at(theta_deg: float, phi_deg: float = 0.0) -> torch.Tensor:
    return from_angles(double(theta_deg).deg2rad(), double(phi_deg).deg2rad())


# --- Fresnel ---------------------------------------------------------------------------------------------------------


def test_normal_incidence():
    """((n - 1)/(n + 1))^2, and with (n, k) in place of n; glass reflects 0.04."""
    assert dielectric(double(1.0), double(1.5)).item() == pytest.approx(0.04, rel=1e-15)
    assert conductor(double(1.0), double(0.2), double(3.9)).item() == pytest.approx(
        (0.8**2 + 3.9**2) / (1.2**2 + 3.9**2), rel=1e-15
    )


@pytest.mark.parametrize("n", [1.0001, 1.33, 1.5, 2.4, 4.0])
def test_brewster(n):
    """At tan theta = n nothing is reflected of p: F is half of rs^2 = ((n^2 - 1)/(n^2 + 1))^2."""
    cosine = double(1 / math.sqrt(1 + n * n))
    expected = 0.5 * ((n - 1) * (n + 1) / (n * n + 1)) ** 2
    assert dielectric(cosine, double(n)).item() == pytest.approx(expected, rel=1e-12)
    assert conductor(cosine, double(n), double(0.0)).item() == pytest.approx(expected, rel=1e-12)


def test_a_conductor_that_absorbs_nothing_is_a_dielectric():
    c, n = torch.meshgrid(torch.linspace(1e-3, 1, 50).double(), torch.linspace(1.001, 4, 40).double(), indexing="ij")
    assert torch.allclose(conductor(c, n, torch.zeros_like(n)), dielectric(c, n), rtol=1e-13, atol=0)


def test_total_reflection_of_a_thinner_medium():
    """k = 0, eta < 1: 1 beyond the critical angle; before it what the other side reflects at the refracted angle."""
    n = 1 / 1.5
    critical = math.sqrt(1 - n * n)
    beyond = conductor(torch.linspace(1e-6, critical - 1e-9, 50).double(), double(n), double(0.0))
    assert torch.allclose(beyond, torch.ones_like(beyond), rtol=1e-14)
    c = torch.linspace(critical + 1e-3, 1, 50).double()
    refracted = torch.sqrt(1 - (1 - c**2) / n**2)
    assert torch.allclose(conductor(c, double(n), double(0.0)), dielectric(refracted, double(1.5)), rtol=1e-11)


def test_fresnel_against_snells_law():
    """60 digits, from grazing to normal incidence, from the thinnest step in the index to a metal."""
    rng = np.random.default_rng(71)
    cosines = np.concatenate([10 ** rng.uniform(-12, 0, 40), 1 - 10 ** rng.uniform(-15, -1, 20), [1.0]])
    for k in range(len(cosines)):
        c, n = cosines[k], 1 + 10 ** rng.uniform(-4, math.log10(3))
        eta, absorbed = 10 ** rng.uniform(-2, 1.3), 10 ** rng.uniform(-0.5, 1.3)
        for got, index in (
            (dielectric(double(c), double(n)), mp.mpf(n)),
            (conductor(double(c), double(eta), double(absorbed)), mp.mpc(eta, absorbed)),
        ):
            true = exact_fresnel(EXACT, mp.mpf(c), index)
            assert abs(got.item() - true) <= 32 * EPS[torch.float64] * true, (c, index, got, true)


@pytest.mark.parametrize("c", [1e-12, 1e-8, 1e-4, 0.01, 0.1, 0.5, 0.9])
def test_derivatives_of_fresnels_factors(c):
    """By cosine and index, each to 1e-12 of itself: towards grazing, where F goes to 1 whatever the index, too."""
    for eta, k in ((1.0001, 0.0), (1.5, 0.0), (4.0, 0.0), (0.2, 3.9), (3.0, 0.1), (0.5, 0.01), (20.0, 20.0)):
        inputs = [double(x).requires_grad_() for x in (c, eta, k)]
        at = [mp.mpf(x) for x in (c, eta, k)]

        def f(*x: mp.mpf) -> mp.mpf:
            return exact_fresnel(EXACT, x[0], mp.mpc(x[1], x[2]))

        true = []
        for j in range(3):
            step = mp.mpf(10) ** -26 * (at[j] or 1)
            ends = [f(*(x + sign * step * (i == j) for i, x in enumerate(at))) for sign in (1, -1)]
            true.append((ends[0] - ends[1]) / (2 * step))
        got = torch.autograd.grad(conductor(*inputs), inputs)
        for one, expected in zip(got, true, strict=True):
            assert abs(one.item() - expected) <= 1e-12 * abs(expected) + (k == 0) * 1e-30, (eta, k, got, true)
        if k == 0:
            for one, expected in zip(torch.autograd.grad(dielectric(*inputs[:2]), inputs[:2]), true, strict=False):
                assert abs(one.item() - expected) <= 1e-12 * abs(expected), (eta, got, true)


def test_no_step_in_the_index_reflects_nothing():
    """eta = 1, k = 0, which is in the conductor's box: 0, with finite derivatives to the lowest h.wo that there is."""
    for c in (FLOOR[torch.float64] / 2, 1e-12, 0.5, 1.0):
        inputs = [double(x).requires_grad_() for x in (c, 1.0, 0.0)]
        for f in (dielectric(*inputs[:2]), conductor(*inputs)):
            assert f.item() == 0
            slopes = torch.autograd.grad(f, inputs, allow_unused=True)
            assert all(slope is None or slope.isfinite() for slope in slopes)


@pytest.mark.parametrize("eta", [0.01, 0.5, 0.8, 1.0, 3.0, 20.0])
def test_conductors_have_finite_derivatives_at_the_critical_angle_and_without_absorption(eta):
    critical = math.sqrt(1 - eta * eta) if eta < 1 else 0.3
    for c in (1e-12, critical, math.nextafter(critical, 0), math.nextafter(critical, 1), 1.0):
        for k in (0.0, 1e-300, 1e-12, 20.0):
            inputs = [double(x).requires_grad_() for x in (c, eta, k)]
            f = conductor(*inputs)
            assert 0 <= f.item() <= 1 + 1e-14
            assert all(slope.isfinite() for slope in torch.autograd.grad(f, inputs))


def test_single_precision_is_the_double_result_rounded():
    c = torch.tensor([1e-12, 1e-3, 0.3, 1.0])
    n, k = torch.tensor(1.0001), torch.tensor(3.0)
    assert torch.equal(dielectric(c, n), dielectric(c.double(), n.double()).float())
    assert torch.equal(conductor(c, n, k), conductor(c.double(), n.double(), k.double()).float())


def test_typical_albedos_are_the_means_of_the_default_indices():
    c, weight = panels([0.0, 0.1, 0.5, 1.0], 40)
    c, weight = torch.tensor(c), torch.tensor(2 * c * weight)
    eta, k = (double(p.default) for p in _fresnel_lobe.CONDUCTOR)
    for mean, f in (
        (_fresnel_lobe.MEAN_DIELECTRIC, dielectric(c, double(_fresnel_lobe.ETA.default))),
        (_fresnel_lobe.MEAN_CONDUCTOR, conductor(c, eta, k)),
    ):
        assert float((weight * f).sum()) == pytest.approx(mean, abs=5e-4)


def test_a_metal_is_what_schlicks_coefficients_are_not():
    """The exact F dips towards grazing where Schlick's rises: aluminium-like (1.1 + 6.9 i) at 80 degrees."""
    c = double(math.cos(math.radians(80)))
    f = conductor(c, double(1.1), double(6.9)).item()
    f0 = conductor(double(1.0), double(1.1), double(6.9)).item()
    assert f < f0 < f0 + (1 - f0) * (1 - c.item()) ** 5


# --- colour in the shape ---------------------------------------------------------------------------------------------

COLOURED = [
    ("ggx(conductor, eta=[0.2, 0.9, 1.1], k=[3.9, 2.4, 2.2], ks=0.9, a=0.2)", 3),
    ("ggx(conductor, eta=0.3, k=[3.9, 2.4], a=0.2) + lambert(kd=0.1)", 2),
    ("kurt(dielectric, eta=[1.3, 1.5, 2], ks=[0.1, 0.5, 0.9]) + lambert(kd=[0.1, 0.2, 0.3]) + beckmann(a=0.3)", 3),
    ("lambert(kd=0.2) + ggx(eta=[1.3, 1.5]) + beckmann(eta=[2, 3], separable) + kurt", 2),
]


def one_channel(value: object, channel: int) -> object:
    return value[channel] if isinstance(value, list) else value


@pytest.mark.parametrize(("text", "channels"), COLOURED)
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_a_shape_with_colour_is_one_gray_shape_a_channel(text, channels, dtype):
    material = bc.material(text)
    assert material.channels == channels
    wi, wo = lobe_pairs(material, np.random.default_rng(72), 50, dtype)
    f = material.f(wi, wo)
    assert f.shape == (len(wi), channels)
    values = {key: value.detach().tolist() for key, value in material.values().items()}
    for channel in range(channels):
        gray = bc.Material(material.form, {key: one_channel(value, channel) for key, value in values.items()})
        assert torch.allclose(f[:, channel], gray.f(wi, wo)[:, 0], rtol=32 * EPS[dtype], atol=0)
    assert material.f(wi[:5, None], wo[:4]).shape == (5, 4, channels)
    assert material.pdf(wi, wo).shape == (len(wi),)


def test_fits_find_indices_of_refraction_by_channel():
    truth = bc.material("beckmann(isotropic, conductor, ks=1, eta=[0.3, 1.2], k=[3, 2], a=0.3)")
    wi, wo = lobe_pairs(truth, np.random.default_rng(73), 400)
    samples = bc.Samples(wi, wo, truth.f(wi, wo).detach(), channels=("one", "two"))
    fit = bc.fit(
        samples,
        "beckmann(isotropic, conductor)",
        fixed={"beckmann.ks": 1.0},
        per_channel=("beckmann.eta", "beckmann.k"),
    )
    assert fit.parameters["beckmann.eta"].tolist() == pytest.approx([0.3, 1.2], rel=1e-3)
    assert fit.parameters["beckmann.k"].tolist() == pytest.approx([3.0, 2.0], rel=1e-3)


def test_what_is_off_is_not_computed():
    for name in NAMES:
        needs = {words: bc.material(f"{name}({words})").form.needs for words in ("schlick", "constant", "dielectric")}
        assert needs["schlick"] == needs["dielectric"] == needs["constant"] | {"h_dot_wo"}
        assert "over_hz" not in bc.material(f"{name}(separable)").form.needs


# --- masking ---------------------------------------------------------------------------------------------------------


def model_of(name: str, *words: str, **values: float) -> tuple[bc.Model, dict[str, torch.Tensor]]:
    text = f"{name}({', '.join([*words, *(f'{key}={value}' for key, value in values.items())])})"
    material = bc.material(text)
    values_ = {key.split(".")[1]: value.detach() for key, value in material.values().items()}
    return material.form.terms[0].model, values_


def g1(model: bc.Model, v: dict[str, torch.Tensor], w: torch.Tensor) -> torch.Tensor:
    x, y, z = w[..., :1], w[..., 1:2], w[..., 2:]
    return (z / (model.seen_from(v, x, y, z) + 0.5 * z))[..., 0]


@pytest.mark.parametrize("theta", [0.0, 30.0, 60.0, 85.0, 89.9])
@pytest.mark.parametrize(("words", "phi"), [({"a": 0.3}, 25.0), ({"a": 2.0}, 25.0), ({"ax": 0.2, "ay": 0.6}, 0.0)])
@pytest.mark.parametrize("name", NAMES)
def test_the_white_furnace_of_the_masking(name, words, phi, theta):
    """The integral of D G1(wo) (wo.h)+ dh is cos theta_o: what is seen of the surface fills its projection.

    In slopes turned to wo's azimuth, dh = cos^3 theta_h dp dq, and wo sees the half plane p > -cot theta_o.
    """
    model, v = model_of(name, **words)
    wo = at(theta, phi)
    along = words.get("a", words.get("ax"))
    across = words.get("a", words.get("ay"))
    cot = min(1 / math.tan(math.radians(theta)) / along, 1e3) if theta else 1e3
    x, dx = panels(np.linspace(-math.atan(cot), math.pi / 2, 17), 16)  # p = along tan x
    y, dy = panels(np.linspace(-math.pi / 2, math.pi / 2, 9), 16)  # q = across sqrt(1 + tan^2 x) tan y
    x, y, weight = (a.ravel() for a in np.broadcast_arrays(x[:, None], y, dx[:, None] * dy))
    p, q = along * np.tan(x), across * np.tan(y) / np.cos(x)
    jacobian = along * across / np.cos(x) ** 3 / np.cos(y) ** 2
    c, s = math.cos(math.radians(phi)), math.sin(math.radians(phi))
    h = torch.tensor(np.stack([c * p - s * q, s * p + c * q, np.ones_like(p)], -1))
    h = h / h.norm(dim=-1, keepdim=True)
    d = model.distribution(v, geometry(h, h, model.normal_needs))[:, 0]
    seen = d * h[:, 2] ** 3 * (h * wo).sum(-1).clamp(min=0) * torch.tensor(weight * jacobian)
    assert float(seen.sum() * g1(model, v, wo)) == pytest.approx(float(wo[2]), rel=1e-6)


SLOPES = {  # the density of slopes along one axis, for a width of 1
    "ggx": lambda q: 1 / (2 * (1 + q**2) ** mp.mpf("1.5")),
    "beckmann": lambda q: mp.exp(-(q**2)) / mp.sqrt(mp.pi),
}


@pytest.mark.parametrize("a", [1e-4, 0.05, 0.5, 3.0, 10.0])
@pytest.mark.parametrize("name", NAMES)
def test_smiths_masking_against_an_integral_over_slopes(name, a):
    """Smith 1967: L(mu) = (1/mu) times the integral of (q - mu) P(q) dq over q > mu, mu = cot theta / a."""
    model, v = model_of(name, a=a)
    context = mp.clone()
    context.dps = 20
    for theta in (1.0, 40.0, 75.0, 89.0, 89.999):
        x, y, z = (mp.mpf(c) for c in at(theta).tolist())
        mu = context.mpf(z / mp.hypot(x, y) / v["a"].item())
        tail = context.quad(lambda q, mu=mu: (q - mu) * SLOPES[name](q), [mu, mu + 1, mu + 10, context.inf])
        assert float(g1(model, v, at(theta))) == pytest.approx(float(1 / (1 + tail / mu)), rel=1e-12)


@pytest.mark.parametrize("width", [{"a": 0.5}, {"ax": 0.1, "ay": 3.0}], ids=str)
@pytest.mark.parametrize("name", NAMES)
def test_correlated_shadowing_is_never_below_separable(name, width):
    """Heitz section 6: a facet high enough to be seen is more likely lit. They agree where one direction is n."""
    one, other = (model_of(name, words, "constant", ks=1.0, **width) for words in ("correlated", "separable"))
    rng = np.random.default_rng(74)
    wi, wo = hemisphere(rng, 500), hemisphere(rng, 500)
    lobes = [model.lobe(v, geometry(wi, wo, model.needs)) for model, v in (one, other)]
    assert bool((lobes[0] >= lobes[1] * (1 - 1e-14)).all())
    assert float((lobes[0] / lobes[1])[lobes[1] > 1e-9].max()) > 1.1
    from_n = [model.lobe(v, geometry(wi, at(0), model.needs)) for model, v in (one, other)]
    assert torch.allclose(from_n[0], from_n[1], rtol=1e-14)


@pytest.mark.parametrize("name", NAMES)
def test_masking_is_the_textbooks(name):
    for width in ({"a": 1e-4}, {"a": 10.0}, {"ax": 0.2, "ay": 5.0}):
        model, v = model_of(name, **width)
        exact = {key: mp.mpf(float(value)) for key, value in v.items()}
        for theta in (0.0, 1e-6, 20.0, 85.0, 90 - 1e-9):
            w = at(theta, 33)
            true = 1 / (1 + masking(EXACT, exact, LAMBDA[name], [mp.mpf(x) for x in w.tolist()]))
            assert float(g1(model, v, w)) == pytest.approx(float(true), rel=4e-15)


def albedo_of(text: str, theta: float) -> float:
    wi, weight = hemisphere_nodes(300, 256)
    return float((bc.material(text).f(wi, at(theta))[:, 0] * wi[:, 2] * weight).sum().detach())


def test_the_albedo_of_ggx_of_width_1():
    """D = 1/pi, so at normal incidence it is the integral of c/(1 + c) dc over [0, 1] = 1 - ln 2 (analytic)."""
    for words in ("correlated", "separable"):
        assert albedo_of(f"ggx({words}, constant, ks=1, a=1)", 0.0) == pytest.approx(1 - math.log(2), rel=1e-9)


@pytest.mark.parametrize("theta", [0.0, 45.0, 70.0])
@pytest.mark.parametrize("name", NAMES)
def test_the_albedo_falls_with_the_width(name, theta):
    """At most ks; what would be reflected again is missing."""
    albedos = [albedo_of(f"{name}(constant, ks=1, a={a})", theta) for a in (0.3, 0.6, 1.0, 3.0)]
    assert 1 > albedos[0] > albedos[1] > albedos[2] > albedos[3] > 0


# --- sampling --------------------------------------------------------------------------------------------------------


def cumulative(p: mp.mpf, r: mp.mpf) -> mp.mpf:
    """The share of visible slopes below p: the integral of (1 + r t) exp(-t^2) dt from -1/r, over its total."""
    root = mp.sqrt(mp.pi)

    def above(t: mp.mpf) -> mp.mpf:
        return mp.erfc(t) / 2 + r * mp.exp(-(t**2)) / (2 * root)

    return 1 - above(p) / above(-1 / r)


@pytest.mark.parametrize("r", [1e-15, 1e-3, 0.05, 0.3, 1.0, 3.0, 50.0, 1e6, 1e13])
def test_the_inversion_of_visible_gaussian_slopes(r):
    """Its distance from the exact cumulative distribution, as the docstring states it."""
    u = torch.cat([torch.linspace(0, 1, 41).double()[:-1], double(1e-12, 1e-6, 1 - 1e-6, 1 - 1e-12, 1 - 2.0**-53)])
    p = _visible_slope(double(r).expand_as(u), u)
    assert bool((p.diff()[:39] > 0).all())
    for slope, share in zip(p.tolist(), u.tolist(), strict=True):
        assert abs(cumulative(mp.mpf(slope), mp.mpf(r)) - mp.mpf(share)) <= 1e-12


@pytest.mark.parametrize("r", [1e-3, 0.3, 3.0, 1e3])
def test_visible_slopes_have_their_derivatives(r):
    u = torch.linspace(0.01, 0.99, 9).double()
    inputs = (torch.full_like(u, r).requires_grad_(), u.clone().requires_grad_())
    assert torch.autograd.gradcheck(_visible_slope, inputs, eps=1e-7 * min(r, 1), atol=1e-5, rtol=1e-4)


@pytest.mark.parametrize("theta", [0.0, 70.0, 89.99])
@pytest.mark.parametrize("text", ["ggx(ax=0.2, ay=0.7)", "beckmann(ax=0.2, ay=0.7)", "ggx(a=3)", "beckmann(a=0.01)"])
def test_no_sample_weighs_more_than_ks(text, theta):
    """Heitz and d'Eon 2014: with visible normals the weight is ks F G2 / G1(wo), and nothing is bright."""
    material = bc.material(f"{text[:-1]}, constant, ks=0.8)")
    u = torch.rand(4000, 3, generator=torch.Generator().manual_seed(5), dtype=torch.float64)
    wo = at(theta, 35)
    wi = material.sample(wo.expand(4000, 3), u).detach()
    weight = material.weight(wi, wo).detach()
    kept = wi[:, 2] > 0
    assert float(weight.max()) <= 0.8 * (1 + 1e-12)
    assert kept.any()
    assert float(weight[kept].min()) > 0


@pytest.mark.parametrize("name", NAMES)
def test_the_normal_sees_the_distribution_itself(name):
    """At normal incidence visible slopes have the density of slopes: Kolmogorov-Smirnov along x and y."""
    model, v = model_of(name, ax=0.3, ay=2.0)
    u = torch.rand(20_000, 2, generator=torch.Generator().manual_seed(6), dtype=torch.float64)
    cdf = {"ggx": lambda s: 0.5 * (1 + s / np.sqrt(1 + s * s)), "beckmann": lambda s: stats.norm.cdf(s * math.sqrt(2))}
    for slopes, width in zip(model.visible_slopes(v, at(0), u), (0.3, 2.0), strict=True):
        assert stats.kstest(slopes[:, 0].numpy() / width, cdf[name]).pvalue > 1e-3


# --- another renderer ------------------------------------------------------------------------------------------------


def walters_fit(tangent: float) -> float:
    """Walter, eq. 27: the rational fit of Beckmann's G1, of r = a tan theta; its error is at most 0.35 %."""
    a = 1 / tangent
    return (3.535 * a + 2.181 * a * a) / (1 + 2.276 * a + 2.577 * a * a) if a < 1.6 else 1.0


def test_walters_fit_of_beckmanns_masking():
    model, v = model_of("beckmann", a=0.5)
    errors = [
        walters_fit(0.5 * math.tan(math.radians(t))) / float(g1(model, v, at(t))) - 1 for t in np.linspace(1, 89.9, 300)
    ]
    assert 2e-3 < max(map(abs, errors)) < 3.6e-3


@pytest.mark.parametrize("name", NAMES)
def test_values_and_densities_against_mitsubas_roughconductor(name):
    """Its f cos theta and its density of visible normals; it is separable, single precision, and uses Walter's fit."""
    mitsuba = pytest.importorskip("mitsuba", reason="needs the renderer Mitsuba 3: pip install mitsuba")
    mitsuba.set_variant("scalar_rgb")
    ax, ay, eta, k = 0.3, 0.1, [0.2, 0.9, 1.1], [3.9, 2.4, 2.2]
    theirs = mitsuba.load_dict(
        {
            "type": "roughconductor",
            "distribution": name,
            "alpha_u": ax,
            "alpha_v": ay,
            "eta": {"type": "rgb", "value": eta},
            "k": {"type": "rgb", "value": k},
        }
    )
    ours = bc.material(f"{name}(separable, ks=1, ax={ax}, ay={ay}, eta={eta}, k={k})")
    model, v = model_of(name, ax=ax, ay=ay)
    context, si = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f()

    def fitted(w: torch.Tensor) -> float:
        if name == "ggx":
            return 1.0
        tangent = math.hypot(ax * w[0], ay * w[1]) / float(w[2])
        return walters_fit(tangent) / float(g1(model, v, w))

    generator = torch.Generator().manual_seed(7)
    for theta, phi in ((10.0, 0.0), (50.0, 40.0), (80.0, 70.0), (88.0, 10.0)):
        wo = at(theta, phi)
        wi = ours.sample(wo.expand(12, 3), torch.rand(12, 3, generator=generator, dtype=torch.float64)).detach()
        wi = wi[wi[:, 2] > 0.01]
        assert len(wi) >= 4
        si.wi = mitsuba.Vector3f(*wo.tolist())
        for w in wi:
            other = mitsuba.Vector3f(*w.tolist())
            f = (ours.f(w, wo) * w[2]).detach() * fitted(w) * fitted(wo)
            assert list(theirs.eval(context, si, other)) == pytest.approx(f.tolist(), rel=2e-5)
            density = ours.pdf(w, wo).item() * fitted(wo)
            assert float(theirs.pdf(context, si, other)) == pytest.approx(density, rel=2e-5)
