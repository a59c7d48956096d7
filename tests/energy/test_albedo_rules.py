"""The rules behind the directional albedo, each against another that shares nothing with it."""

import itertools
import math

import numpy as np
import pytest
import torch
from albedo_cases import prepared, random_case

import brdfcore as bc
from brdfcore.energy import grading
from brdfcore.energy.chords import _kernel, _level
from brdfcore.energy.closed_forms import EXACT
from brdfcore.energy.grading import SCALES, Dense, graded
from brdfcore.energy.lobes import PROFILES
from brdfcore.energy.plan import SINGLE
from brdfcore.energy.refinement import Rows
from brdfcore.energy.rules import LADDER, gauss, ring
from brdfcore.energy.slope_disc import SlopeDisc
from brdfcore.errors import InvalidValueError

# --- rules in one dimension ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [4, 7, 16, 64, 320])
def test_gauss_is_exact_to_its_degree(n):
    rule = gauss(n)
    assert float(rule.weights.sum()) == pytest.approx(1, abs=4e-16)
    assert (rule.nodes + rule.rest).tolist() == pytest.approx([1.0] * n, abs=2e-16)
    for degree in (1, n, 2 * n - 1):
        assert float(rule.weights @ rule.nodes**degree) == pytest.approx(1 / (degree + 1), rel=1e-14)
    if n < 10:
        assert float(rule.weights @ rule.nodes ** (2 * n)) != pytest.approx(1 / (2 * n + 1), rel=1e-12)


def test_gauss_knows_the_spectrum():
    """P_3 (2 x - 1) + 1e-3 P_7 on 10 nodes: the last quarter of degrees 0 to 9 holds the 1e-3, the third the rest."""
    rule = gauss(10)
    x = 2 * rule.nodes.numpy() - 1
    values = np.polynomial.legendre.legval(x, [0, 0, 0, 0, 0, 0.5, 0, 1e-3])
    tail = rule.tail((torch.tensor(values) * rule.weights)[:, None])
    assert tail.early.tolist() == pytest.approx([0.5])
    assert tail.late.tolist() == pytest.approx([1e-3])
    assert (tail.early_at, tail.late_at, tail.alias) == (5.0, 8.0, 20)


@pytest.mark.parametrize("mirrored", [True, False])
def test_ring_is_exact_below_its_alias(mirrored):
    rule = ring(12, mirrored=mirrored)
    assert float(rule.weights.sum()) == pytest.approx(2 * math.pi, rel=1e-15)
    for harmonic in range(1, 12):
        assert float(rule.weights @ torch.cos(harmonic * rule.nodes)) == pytest.approx(0, abs=1e-14)
    assert float(rule.weights @ torch.cos(12 * rule.nodes)) == pytest.approx(2 * math.pi, rel=1e-14)
    phase = 0.0 if mirrored else 0.3
    tail = rule.tail((0.25 * torch.cos(5 * rule.nodes - phase) * rule.weights)[:, None])
    assert tail.late.tolist() == pytest.approx([0.25 * 2 * math.pi], rel=1e-13)


def test_the_ladder_climbs():
    assert list(LADDER) == sorted(set(LADDER))
    assert max(b / a for a, b in itertools.pairwise(LADDER)) <= 1.25


@pytest.mark.parametrize("y", [1e-9, 0.3, 3.0, 28.0])
def test_graded_angles_go_once_round(y):
    """cos D by its definition, and the integral of dD/dw over the circle is 2 pi."""
    w = torch.linspace(0, 2 * math.pi, 4097, dtype=torch.float64)[:-1]
    cosine, sine, slope = graded(w, torch.full_like(w, y))
    assert torch.allclose(cosine, torch.sinh(y * torch.cos(w)) / math.sinh(y), rtol=0, atol=1e-13)
    assert torch.allclose(cosine.square() + sine.square(), torch.ones_like(w), rtol=1e-12)
    assert float(slope.mean()) == pytest.approx(1, abs=1e-12)


def test_a_dense_map_is_inverted_and_goes_once_round():
    """The v of its w are equal steps, the mean of dw/dv is 1, and dw/dv is the quotient of differences."""
    rng = np.random.default_rng(7)
    width = torch.tensor(10 ** rng.uniform(-3, 0, (16, 2))).repeat_interleave(SCALES, 1)
    width = (width * 3.5 ** (torch.arange(2 * SCALES) % SCALES)).clamp(max=1.0)
    place = torch.tensor(rng.uniform(-7, 7, (16, 2))).repeat_interleave(SCALES, 1)
    dense = Dense(torch.full((16, 1), 0.08).double(), place, width)
    v = torch.arange(8192, dtype=torch.float64)[None] * (2 * math.pi / 8192)
    w, slope = dense.at(v)
    assert torch.allclose(torch.sin(0.5 * (dense.before(w)[0] - v)), torch.zeros_like(w), rtol=0, atol=1e-13)
    assert torch.allclose(slope.mean(1), slope.new_ones(16), rtol=0, atol=1e-12)
    ahead = dense.at(v + 1e-6)[0]
    assert torch.allclose(torch.remainder(ahead - w, 2 * math.pi) / 1e-6, slope, rtol=0, atol=1e-2 * float(slope.max()))


# --- integrals -------------------------------------------------------------------------------------------------------


def test_a_power_that_underflows_reflects_nothing_for_certain():
    form, values = prepared("lafortune(ks=0.3, cx=-0.19, cy=-0.57, n=2949)")
    found = bc.energy.albedo.of_form(form, values, torch.tensor([0.26, 0.15]).double(), torch.tensor(2.1), 1e-12)
    assert found.values.tolist() == found.error.tolist() == [[0.0], [0.0]]
    assert found.met


def test_every_model_has_a_rule():
    assert set(bc.MODELS) == set(EXACT) | set(SINGLE) | set(PROFILES)
    assert set(EXACT) & (set(SINGLE) | set(PROFILES)) == set()


CLOSED = [
    "lambert(kd=1)",
    "ashikhmin_shirley_diffuse(kd=1, f0=0.1)",
    "oren_nayar(kd=1, sigma=0.6)",
    "oren_nayar(energy_preserving, kd=0.4, sigma=1.2)",
    "ward_bounded(rs=1, a=0.3)",
    "ward_bounded(rs=1, ax=0.1, ay=0.7)",
    "ward_neumann(rs=1, a=0.4)",
    "lafortune(ks=1, cx=-0.9, cy=-0.5, n=7.5)",
    "lafortune(ks=1, cx=0.6, cy=-1.3, n=1)",
    "edwards(ks=1, rx=0.4, ry=0.9, n=1.5)",
    "edwards(ks=1, rx=1, ry=1, n=1)",
]
LOBES = [
    "coupled_lambert(kd=1, f0=0)",
    "ward(rs=1, a=0.2)",
    "ward_duer(rs=1, ax=0.1, ay=0.5)",
    "ward_neumann(rs=1, ax=0.4, ay=0.1)",
    "ward_bounded(rs=1, a=0.3)",
    "ashikhmin_shirley(nu=20, nv=3, f0=0.2)",
    "kurt(m=0.3, alpha=0.4, ks=1)",
    "kurt_plausible(constant, m=0.8, ks=1)",
    "blinn_phong(ks=1, n=12)",
    "cook_torrance(constant, ks=1, a=0.5)",
    "ashikhmin_premoze(dielectric, eta=1.5, ks=1, ax=0.2, ay=0.6)",
    "ggx(conductor, eta=0.5, k=2, ks=1, ax=0.3, ay=0.8)",
    "ggx(constant, separable, ks=1, a=0.7)",
    "beckmann(constant, ks=1, a=1.4)",
]


@pytest.mark.parametrize("text", [*CLOSED, *LOBES])
def test_every_rule_agrees_with_the_cells_of_samples(text):
    """`hemisphere` knows nothing of a lobe but its formula and its sampler."""
    form, values = prepared(text)
    cosine = torch.tensor([1.0, 0.6, 0.15], dtype=torch.float64)
    found = bc.energy.of_form(form, values, cosine, torch.tensor(0.7), 1e-8)
    cells = bc.energy.of_form(form, values, cosine, torch.tensor(0.7), 1e-4, "hemisphere")
    assert found.met
    assert bool((cells.error <= 5e-3).all())
    assert bool(((found.values - cells.values).abs() <= found.error + cells.error).all())


@pytest.mark.parametrize(
    "text", ["ward_bounded(rs=1, a={})", "ward_bounded(rs=1, ax={}, ay=0.3)", "ward_bounded(rs=1, ax=2, ay={})"]
)
@pytest.mark.parametrize("width", [1e-4, 0.02, 0.7, 10.0])
def test_chords_agree_with_rays(text, width):
    """Two quadratures of the same integral, to 1e-12 at every angle."""
    form, values = prepared(text.format(width))
    cosine = torch.cat([torch.linspace(0.05, 1, 8), 10.0 ** -torch.arange(2, 8)]).double()
    chords, rays = (
        bc.energy.of_form(form, values, cosine, torch.tensor(0.9), 1e-12, m) for m in ("closed_form", "slope_disc")
    )
    assert chords.met
    assert rays.met
    assert torch.allclose(chords.values, rays.values, rtol=0, atol=2e-12)


@pytest.mark.parametrize("width", [1e-4, 0.02, 0.7, 10.0])
def test_arcs_agree_with_rays(width):
    """To 1e-12 at every angle; one of them, 30 degrees, at which two ends of the arcs' intervals meet."""
    form, values = prepared(f"ward_neumann(rs=1, a={width})")
    cosine = torch.cat([torch.linspace(0.05, 1, 8), torch.tensor([0.75**0.5, 0.8660]), 10.0 ** -torch.arange(2, 13)])
    arcs, rays = (
        bc.energy.of_form(form, values, cosine.double(), torch.tensor(0.9), 1e-12, m)
        for m in ("closed_form", "slope_disc")
    )
    assert arcs.met
    assert rays.met
    assert arcs.evaluations < 0.2 * rays.evaluations
    assert torch.allclose(arcs.values, rays.values, rtol=0, atol=2e-12)


def test_arcs_are_of_isotropic_lobes():
    """The anisotropic one is integrated along rays."""
    form, values = prepared("ward_neumann(rs=1, ax=0.1, ay=0.3)")
    assert bc.energy.of_form(form, values, torch.tensor(0.5), torch.tensor(0.0)).method == "slope_disc"
    with pytest.raises(InvalidValueError, match="Expected method to suit ward_neumann, got closed_form"):
        bc.energy.of_form(form, values, torch.tensor(0.5), torch.tensor(0.0), 1e-6, "closed_form")


def test_the_chords_kernel():
    """Against its integral by 200 nodes, on both sides of where its closed form begins."""
    t, w = np.polynomial.legendre.leggauss(200)
    for c in (0.0, 0.4, 3.0):
        for d in (1e-3, 0.1999, 0.2001, 1.0, 5.0):
            expected = (w * (1 - t * t) * np.exp(-((c + d * t) ** 2))).sum()
            got = _kernel(torch.tensor(c, dtype=torch.float64), torch.tensor(d, dtype=torch.float64))
            assert float(got) == pytest.approx(expected, rel=3e-13 if c < 1 else 1e-11), (c, d)
            if c == 0:
                assert float(_level(torch.tensor(d, dtype=torch.float64))) == pytest.approx(expected, rel=3e-14)


@pytest.mark.parametrize(
    ("text", "theta", "phi"),
    [
        ("ggx(constant, correlated, ks=1, ax=0.0344, ay=2.05)", 89.985, 173.07),
        ("ggx(constant, separable, ks=1, ax=6.2, ay=0.148)", 89.99, 53.9),
        ("ggx(constant, separable, ks=1, ax=9.72, ay=5e-4)", 89.962, 13.87),
    ],
)
def test_a_narrow_and_a_wide_width_are_a_reference_too(text, theta, phi, monkeypatch):
    """To 1e-12 with the rays that are dense where masking changes; without them, the same to 1e-9."""
    form, values = prepared(text)
    at = torch.tensor(math.cos(math.radians(theta))).double(), torch.tensor(math.radians(phi)).double()
    found = bc.energy.of_form(form, values, *at, 1e-12)
    assert found.met
    assert found.evaluations < 3e6  # of 1e7 and more without
    monkeypatch.setattr(grading, "SLIGHT", math.inf)
    without = bc.energy.of_form(form, values, *at, 1e-9)
    assert float((found.values - without.values).abs().max()) <= 1e-9


def test_a_masking_that_is_smooth_but_not_analytic_is_a_reference_too():
    """To 1e-12 where a lobe is narrow and wide at once: that takes 900 nodes on a ray, and no more than 500 rays."""
    form, values = prepared("beckmann(separable, ks=0.5856, f0=0.8094, ax=0.0067736, ay=9.8129)")
    found = bc.energy.of_form(form, values, torch.tensor(9.8855e-4).double(), torch.tensor(0.240949), 1e-12)
    assert found.met, f"{float(found.error):.3e}"
    assert found.evaluations < 5e6  # of 4e7 where more rays are to make up for too few nodes on them


def test_rays_are_dense_where_they_can_be_at_the_horizon_itself():
    """The wi whose masking changes is opposite to wo there to rounding, and has no half vector."""
    form, values = prepared("ggx(anisotropic, ks=1, ax=0.05, ay=0.5)")
    for co in (1e-8, 1e-10):
        precise, plain = (
            bc.energy.of_form(form, values, torch.tensor(co).double(), torch.tensor(0.0), tolerance)
            for tolerance in (1e-12, 1e-7)
        )
        assert precise.met
        assert float(precise.values) == pytest.approx(float(plain.values), abs=1e-7)


@pytest.mark.parametrize("text", LOBES[1:6])
def test_rays_agree_with_the_tests_own_disc(text):
    """The Cartesian slope-disc quadrature that the models' own tests trust, which meets a kink anywhere: 1e-5."""
    form, values = prepared(text)
    theta = math.radians(70)
    tangent, sec = math.tan(theta), 1 / math.cos(theta)
    x, w = np.polynomial.legendre.leggauss(500)
    psi, dpsi = (x + 1) * math.pi / 4, w * math.pi / 4
    eta, deta = x * math.pi / 2, w * math.pi / 2
    psi, eta = np.meshgrid(psi, eta, indexing="ij")
    p, q = tangent - sec * np.cos(2 * psi), sec * np.sin(2 * psi) * np.sin(eta)
    e2 = p * p + q * q
    h_dot_wo = (1 + tangent * p) / sec / np.sqrt(1 + e2)
    area = 2 * (sec * np.sin(2 * psi)) ** 2 * np.cos(eta) * np.outer(dpsi, deta)
    h = np.stack([p, q, np.ones_like(p)], -1) / np.sqrt(1 + e2)[..., None]
    wo = np.array([math.sin(theta), 0, math.cos(theta)])
    wi = torch.tensor(2 * h_dot_wo[..., None] * h - wo)
    weight = torch.tensor(4 * h_dot_wo * (1 + e2) ** -1.5 * area)
    f = bc.Material(form, values).f(wi, torch.tensor(wo)).detach()[..., 0]
    expected = float((f * wi[..., 2].clamp(min=0) * weight).sum())
    got = bc.energy.of_form(form, values, torch.tensor(math.cos(theta)), torch.tensor(0.0), 1e-9).values
    assert float(got) == pytest.approx(expected, rel=1e-5)


def test_rays_are_where_they_say():
    """The geometry at the nodes is that of real directions: cosines, slopes and h.wo, checked through coupled terms.

    With f = 1 the integral of cos theta_i is pi, whatever the half vectors' widths.
    """
    _, values = prepared("coupled_lambert(kd=1, f0=0)")
    co, azimuth = torch.tensor([1.0, 0.5, 1e-3]).double(), torch.zeros(3).double()
    own = {"kd": values["coupled_lambert.kd"].reshape(1, 1), "f0": values["coupled_lambert.f0"].reshape(1, 1)}

    class One(bc.MODELS["coupled_lambert"]):  # type: ignore[misc,name-defined]
        needs = frozenset({"ci"})

        def basis(self, values, g):
            return (torch.ones_like(g.ci),)

    rule = SlopeDisc(One(), own, Rows(co, azimuth), 1e-14)
    total = rule.sums(own, torch.arange(3), 128, 64).bases[:, 0, 0]
    assert total.tolist() == pytest.approx([math.pi] * 3, rel=1e-10)


def test_the_unfamiliar_is_integrated_by_cells(monkeypatch):
    """A model that no registry of rules knows."""
    monkeypatch.delitem(PROFILES, "kurt")
    rng = np.random.default_rng(4)
    case = random_case(rng, bc.MODELS["kurt"](("isotropic", "schlick")), 1)._replace(
        co=torch.tensor([0.7]).double(), tolerance=1e-4
    )
    found = case.albedo()
    assert found.method == "hemisphere"
    monkeypatch.undo()
    assert found.met
    assert torch.allclose(found.values, case.albedo(1e-9).values, rtol=0, atol=1e-4)
