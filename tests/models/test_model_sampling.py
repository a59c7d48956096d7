"""Samples against densities, densities against textbook ones, weights against the papers' and against quadrature."""

import functools
import itertools
import math
from typing import Any

import numpy as np
import pytest
import torch
from chi_square import cells_of, p_value, sidak
from model_cases import (
    CHOICE_IDS,
    CHOICES,
    COVERING,
    DTYPES,
    EVERY_CHOICE,
    corners,
    draw_values,
    form_of,
    hemisphere,
    material_of,
    name_of,
)
from scipy import stats

import brdfcore as bc
from brdfcore.geometry import from_angles
from brdfcore.hard_cases.formulas import entry

LEVEL = 0.01  # of all tests of one tier together (Sidak)
COUNT = {"default": 30_000, "full": 1_000_000}
DIRECTIONS = [(0.0, 0.0), (45.0, 40.0), (80.0, 115.0), (89.9, 200.0)]  # theta_o, phi_o in degrees
WIDTHS = (0.15, 0.5, 0.85)  # where in the logarithm of the search range


def direction(theta_deg: float, phi_deg: float) -> torch.Tensor:
    return from_angles(*torch.tensor([theta_deg, phi_deg], dtype=torch.float64).deg2rad())


def shaped(choice: bc.Model, fraction: float) -> bc.Material:
    """The choice with its widths at a fraction of their search range; a second width lies elsewhere in it."""
    shapes = [p for p in choice.parameters if p.scale == "log"]
    values = {}
    for k, p in enumerate(shapes):
        low, high = (math.log(x) for x in p.search_range)
        values[p.name] = math.exp(low + (high - low) * (fraction + 0.2 * k if fraction < 0.6 else fraction - 0.2 * k))
    return material_of(choice, values)


def uniform(count: int, seed: int) -> torch.Tensor:
    return torch.rand(count, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(seed))


def sampled(material: bc.Material, wo: torch.Tensor, count: int, seed: int) -> torch.Tensor:
    return material.sample(wo.expand(count, 3), uniform(count, seed)).detach()


def chi_square(material: bc.Material, wo: torch.Tensor, count: int, pdf=None, sample=None) -> float:
    """The p-value of `count` samples (of `sample`, or the material's) against the material's density, or `pdf`."""
    sample = sample or (lambda count, seed: sampled(material, wo, count, seed))
    cells = cells_of(sample(20_000, 1))
    return p_value(sample(count, 2), pdf or (lambda wi: material.pdf(wi, wo)), cells)


# --- chi-square ------------------------------------------------------------------------------------------------------

EVERY_CASE = list(itertools.product(CHOICES, WIDTHS, DIRECTIONS))
# The default tier: two cases a covering choice, of other widths and directions from one choice to the next.
SOME_CASES = [
    (choice, width, towards)
    for (k, choice), (i, width), (j, towards) in itertools.product(*map(enumerate, (COVERING, WIDTHS, DIRECTIONS)))
    if (k + i + j) % 4 == 0 and i != k % 3
]


def _id(case: tuple[bc.Model, float, tuple[float, float]]) -> str:
    return f"{name_of(case[0])}-{case[1]}-{case[2][0]}"


@pytest.mark.parametrize("case", SOME_CASES, ids=_id)
def test_samples_follow_their_density(case):
    choice, width, (theta, phi) = case
    p = chi_square(shaped(choice, width), direction(theta, phi), COUNT["default"])
    assert p > sidak(LEVEL, len(SOME_CASES)), p


@pytest.mark.full
@pytest.mark.parametrize("case", EVERY_CASE, ids=_id)
def test_samples_follow_their_density_in_full(case):
    choice, width, (theta, phi) = case
    p = chi_square(shaped(choice, width), direction(theta, phi), COUNT["full"])
    assert p > sidak(LEVEL, len(EVERY_CASE)), p


SUMS = [
    "lambert(kd=0.3) + ward_bounded(rs=0.2, a=0.1)",
    "coupled_lambert(kd=[0.1, 0.5, 0.3], f0=kurt.f0) + kurt(ks=[0.9, 0.8, 0.1], mx=0.1, my=0.4)",
    "ashikhmin_shirley(nu=10, nv=400, f0=0.3) + ashikhmin_shirley_diffuse(kd=0.4, f0=ashikhmin_shirley.f0)",
    "lambert(kd=0.2) + kurt(ks=0.4, m=0.3, f0=0.5) + kurt(ks=0.5, m=0.05, f0=0.9)",
    "lambert(kd=0) + ward(rs=0)",
]


@pytest.mark.parametrize("theta", [20.0, 85.0])
@pytest.mark.parametrize("text", SUMS)
def test_samples_of_sums_follow_the_mixture(text, theta):
    p = chi_square(bc.material(text), direction(theta, 30), COUNT["default"])
    assert p > sidak(LEVEL, 2 * len(SUMS)), p


@pytest.mark.parametrize("text", ["kurt(mx=0.05, my=0.3)", "ashikhmin_shirley(nu=10, nv=1000)", "lambert"])
def test_samples_in_float32_follow_the_density(text):
    material, wo = bc.material(text), direction(60, 20)

    def sample(count: int, seed: int) -> torch.Tensor:
        wi = material.sample(wo.float().expand(count, 3), uniform(count, seed).float()).detach()
        assert wi.dtype == torch.float32
        return wi

    p = chi_square(material, wo, COUNT["default"], sample=sample)
    assert p > sidak(LEVEL, 3), p


# --- its power: what it must reject, with the same counts -------------------------------------------------------------

REJECT = 1e-6


def _cos_theta_h(wi: torch.Tensor, wo: torch.Tensor) -> torch.Tensor:
    h = wi + wo
    return h[..., 2] / h.norm(dim=-1)


def _h_dot_wo(wi: torch.Tensor, wo: torch.Tensor) -> torch.Tensor:
    return (wi + wo).norm(dim=-1) / 2


WRONG = {
    "without 4 (h.wo)": lambda pdf, wi, wo: pdf(wi, wo) * 4 * _h_dot_wo(wi, wo),
    "a factor cos theta_h too many": lambda pdf, wi, wo: pdf(wi, wo) * _cos_theta_h(wi, wo),
    "a factor cos theta_h too few": lambda pdf, wi, wo: pdf(wi, wo) / _cos_theta_h(wi, wo),
    "per projected solid angle (G-M&D eq. 7)": lambda pdf, wi, wo: pdf(wi, wo) / wi[..., 2].clamp(min=0.1),
    "2 % too large": lambda pdf, wi, wo: pdf(wi, wo) * 1.02,
}


@pytest.mark.parametrize("text", ["ashikhmin_shirley(nu=10, nv=100)", "ward(ax=0.3, ay=0.1)"])
@pytest.mark.parametrize("wrong", WRONG)
def test_wrong_densities_are_rejected(text, wrong):
    material, wo = bc.material(text), direction(30, 40)
    p = chi_square(material, wo, COUNT["default"], pdf=lambda wi: WRONG[wrong](material.pdf, wi, wo))
    assert p < REJECT, p


def test_the_density_inverted_as_in_the_jgt_versions_equation_18_is_rejected():
    """There p(k2) = 4 (k1.h) / p_h(h)."""
    material, wo = bc.material("ashikhmin_shirley(nu=2, nv=4)"), direction(30, 40)
    assert chi_square(material, wo, COUNT["default"]) > LEVEL
    assert chi_square(material, wo, COUNT["default"], pdf=lambda wi: 1 / material.pdf(wi, wo)) < REJECT


def test_wrong_widths_are_rejected():
    wo = direction(30, 40)
    for good, bad in (("ward(a=0.1)", "ward(a=0.105)"), ("ward(ax=0.1, ay=0.3)", "ward(ax=0.3, ay=0.1)")):
        wrong = bc.material(bad)
        p = chi_square(bc.material(good), wo, COUNT["default"], pdf=lambda wi, wrong=wrong: wrong.pdf(wi, wo))
        assert p < REJECT, (good, bad, p)


def test_a_sampler_that_loses_quadrants_is_rejected():
    """arctan instead of atan2 (Kurt eq. 17, Walter eq. 7): every half vector leans to x > 0."""
    material, wo = bc.material("ward(ax=0.3, ay=0.1)"), direction(30, 40)

    def sample(count: int, seed: int) -> torch.Tensor:
        u = uniform(count, seed)
        u[:, 2] = torch.where((u[:, 2] > 0.25) & (u[:, 2] < 0.75), torch.remainder(u[:, 2] + 0.5, 1), u[:, 2])
        return material.sample(wo.expand(count, 3), u).detach()

    cells = cells_of(sampled(material, wo, 20_000, 1))
    assert p_value(sample(COUNT["default"], 2), lambda wi: material.pdf(wi, wo), cells) < REJECT


@pytest.mark.parametrize("text", ["nu=10, nv=400", "nu=3000, nv=2", "n=50"])
def test_ashikhmin_and_shirleys_samples_keep_their_strata_in_every_quadrant(text):
    """Techreport eqs. 21, 22, a quarter of xi_1 for each quadrant, the second and fourth flipped; none overlap."""
    material = bc.material(f"ashikhmin_shirley({text})")
    xi_1, xi_2 = (torch.arange(n, dtype=torch.float64).add(0.5) / n for n in (64, 7))
    u = torch.stack(torch.broadcast_tensors(torch.tensor(0.5), xi_1[:, None], xi_2), -1)
    h = torch.nn.functional.normalize(material.sample(direction(0, 0), u).detach() + direction(0, 0), dim=-1)

    values = [x.item() for key, x in material.values().items() if key.split(".")[1] in ("n", "nu", "nv")]
    nu, nv = values[0], values[-1]
    quadrant = (4 * xi_1).floor()
    part = 4 * xi_1 - quadrant
    part = torch.where(quadrant % 2 == 0, part, 1 - part)
    phi = torch.atan(math.sqrt((nu + 1) / (nv + 1)) * torch.tan(math.pi / 2 * part))
    phi = torch.where(quadrant % 2 == 0, phi, math.pi - phi) + math.pi * (quadrant // 2)
    assert bool((phi.diff() > 0).all()), "strata follow each other round the circle"
    height = (1 - xi_2) ** (1 / (nu * torch.cos(phi) ** 2 + nv * torch.sin(phi) ** 2 + 1))[:, None]
    below = height <= math.sqrt(0.5)  # wi is below the horizon, and wi + wo another half vector's
    side = torch.sqrt(1 - height**2)
    expected = torch.stack([side * torch.cos(phi)[:, None], side * torch.sin(phi)[:, None], height], -1)
    assert float((h - expected).abs().amax(-1)[~below].max()) <= 1e-13
    assert int(below.sum()) < below.numel() / 4


def test_redrawing_what_falls_below_the_horizon_is_rejected():
    """models.md: "Redrawing it biases the estimator"."""
    material, wo = bc.material("ward(a=0.3)"), direction(80, 0)
    drawn = sampled(material, wo, 2 * COUNT["default"], 2)
    kept = drawn[drawn[:, 2] > 0][: COUNT["default"]]
    assert len(kept) == COUNT["default"]
    assert p_value(kept, lambda wi: material.pdf(wi, wo), cells_of(sampled(material, wo, 20_000, 1))) < REJECT


# --- weights ---------------------------------------------------------------------------------------------------------


def _fresnel(c: torch.Tensor, v: dict[str, torch.Tensor]) -> torch.Tensor:
    """Schlick's factor of f0, Fresnel's equations for an index eta + i k, or 1."""
    if "eta" in v:
        index = torch.complex(v["eta"], v.get("k", torch.zeros_like(v["eta"])))
        g = torch.sqrt(index**2 - 1 + c**2)
        rs, rp = (c - g) / (c + g), (index**2 * c - g) / (index**2 * c + g)
        return (rs.abs() ** 2 + rp.abs() ** 2) / 2
    return v["f0"] + (1 - v["f0"]) * (1 - c) ** 5 if "f0" in v else torch.ones_like(c)


def _quantities(wi: torch.Tensor, wo: torch.Tensor, v: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    h = torch.nn.functional.normalize(wi + wo, dim=-1)
    cos_d = (h * wo).sum(-1)
    fresnel = _fresnel(cos_d, v)
    side = wi[:, 0] * wo[0] + wi[:, 1] * wo[1]  # cos(phi_i - phi_o) sin theta_i sin theta_o
    return {
        "d": cos_d,
        "h": h[:, 2],
        "i": wi[:, 2],
        "o": wo[2].expand(len(wi)),
        "F": fresnel,
        "side": side,
        "wi": wi,
        "wo": wo,
    }


def _eon_weight(q: dict[str, torch.Tensor], v: dict[str, torch.Tensor]) -> torch.Tensor:
    """pi f of Portsmouth, Kutz and Hill 2025, listing 1 with the exact directional albedo."""
    r = 2 * v["sigma"] / math.pi
    a = 1 / (1 + (1 / 2 - 2 / (3 * math.pi)) * r)

    def albedo(mu: torch.Tensor) -> torch.Tensor:
        sine = torch.sqrt((1 - mu) * (1 + mu))
        g = sine * (torch.acos(mu) - sine * mu) + 2 / 3 * (sine / mu * (1 - sine**3) - sine)
        return a + r * a / math.pi * g

    t = torch.where(q["side"] > 0, q["side"] / torch.maximum(q["i"], q["o"]), q["side"])
    mean = a * (1 + (2 / 3 - 28 / (15 * math.pi)) * r)
    often = v["kd"] ** 2 * mean / (1 - v["kd"] * (1 - mean)) / (1 - mean)
    return v["kd"] * a * (1 + r * t) + often * (1 - albedo(q["i"])) * (1 - albedo(q["o"]))


def _smith_weight(masking, *, separable=False):
    """Heitz and d'Eon 2014: F G2 / G1(wo), with G from Lambda as a function of a tan theta."""

    def formula(q: dict[str, torch.Tensor], v: dict[str, torch.Tensor]) -> torch.Tensor:
        width = torch.stack([v["a"], v["a"]] if "a" in v else [v["ax"], v["ay"]])
        i, o = (masking((width * q[w][..., :2]).norm(dim=-1) / q[w][..., 2]) for w in ("wi", "wo"))
        return v["ks"] * q["F"] * (1 / (1 + i) if separable else (1 + o) / (1 + i + o))

    return formula


def _ggx_masking(tangent: torch.Tensor) -> torch.Tensor:
    return (torch.sqrt(1 + tangent**2) - 1) / 2


def _beckmann_masking(tangent: torch.Tensor) -> torch.Tensor:
    a = 1 / tangent.clamp(min=1e-3)
    return (torch.erf(a) - 1) / 2 + torch.exp(-(a**2)) / (2 * a * math.sqrt(math.pi))


def _compensated_weight(masking, normals, *, separable=False):
    """The same, and Kulla and Conty's term, over the mixture of the two densities."""
    single = _smith_weight(masking, separable=separable)

    def formula(q: dict[str, torch.Tensor], v: dict[str, torch.Tensor]) -> torch.Tensor:
        model = bc.MODELS[normals]((("separable" if separable else "correlated"), "constant", "compensated"))
        a = v["a"]
        i, o, mean = model.lost(q["i"], a), model.lost(q["o"], a), model.mean_lost(a)
        e2 = (1 / q["h"] ** 2 - 1) / a**2
        d = (torch.exp(-e2) if normals == "beckmann" else (1 + e2) ** -2) / (math.pi * a**2 * q["h"] ** 4)
        visible = d / (1 + masking(a * (1 - q["o"] ** 2).sqrt() / q["o"])) / (4 * q["o"])
        c = torch.linspace(0, 1, 20_001).double()[:, None]
        factor = torch.trapezoid(2 * c * _fresnel(c, v), c, dim=0)
        share = factor**2 * (1 - mean) / (1 - factor * mean)
        returned = v["ks"] * share * i * o * q["i"] / (math.pi * mean)
        broad = q["i"] / (math.pi * (q["i"] ** 2 + a**2) * torch.log(1 + 1 / a**2))
        return (single(q, v) * visible + returned) * (1 + o) / (visible + o * broad)

    return formula


# Each paper's own weight f cos_i / pdf for a wi drawn from the lobe; q as _quantities, v the values.
PAPER_WEIGHT = {
    "ggx": _smith_weight(_ggx_masking),
    "ggx(separable)": _smith_weight(_ggx_masking, separable=True),
    "beckmann": _smith_weight(_beckmann_masking),
    "beckmann(separable)": _smith_weight(_beckmann_masking, separable=True),
    "ggx(compensated)": _compensated_weight(_ggx_masking, "ggx"),
    "ggx(separable, compensated)": _compensated_weight(_ggx_masking, "ggx", separable=True),
    "beckmann(compensated)": _compensated_weight(_beckmann_masking, "beckmann"),
    "beckmann(separable, compensated)": _compensated_weight(_beckmann_masking, "beckmann", separable=True),
    "lambert": lambda q, v: v["kd"] + 0 * q["i"],
    "coupled_lambert": lambda q, v: v["kd"] * (1 - q["F"]),
    "ashikhmin_shirley_diffuse": lambda q, v: (
        28 / 23 * v["kd"] * (1 - v["f0"]) * (1 - (1 - q["i"] / 2) ** 5) * (1 - (1 - q["o"] / 2) ** 5)
    ),
    "ward": lambda q, v: v["rs"] * q["d"] * q["h"] ** 3 * torch.sqrt(q["i"] / q["o"]),  # Walter eq. 10
    "ward_duer": lambda q, v: v["rs"] * q["d"] * q["h"] ** 3 / q["o"],  # G-M&D eq. 8 per solid angle
    "ward_neumann": lambda q, v: v["rs"] * q["d"] * q["h"] ** 3 * q["i"] / torch.maximum(q["i"], q["o"]),
    "ward_bounded": lambda q, v: 2 * v["rs"] / (1 + q["o"] / q["i"]),  # G-M&D eq. 15
    "ashikhmin_shirley": lambda q, v: v.get("ks", 1.0) * q["F"] * q["i"] / torch.maximum(q["i"], q["o"]),
    "kurt": lambda q, v: v["ks"] * q["F"] * q["i"] ** (1 - v["alpha"]) / (q["h"] * q["o"] ** v["alpha"]),  # Kurt eq. 21
    "kurt_plausible": lambda q, v: v["ks"] * q["F"] * q["i"] / (q["h"] * torch.maximum(q["i"], q["o"])),
    "blinn_phong": lambda q, v: v["ks"] * (v["n"] + 2) / (v["n"] + 1) * q["d"] * q["i"],
    "cook_torrance": lambda q, v: (
        v["ks"]
        * q["F"]
        * q["d"]
        / (q["h"] * q["o"])
        * (2 * q["h"] / q["d"] * torch.minimum(q["i"], q["o"])).clamp(max=1)
    ),
    "ashikhmin_premoze": lambda q, v: v["ks"] * q["F"] * q["d"] * q["i"] / (q["i"] + q["o"] - q["i"] * q["o"]),
    "lafortune": lambda q, v: (
        v["ks"]
        * (v["n"] + 2)
        / (v["n"] + 1)
        * q["i"]
        * (torch.stack([v["cx"], v["cy"], torch.ones_like(v["cx"])]) * q["wo"]).norm() ** v["n"]
    ),
    "edwards": lambda q, v: v["ks"] + 0 * q["i"],  # the lump's own density: every sample weighs the same
    "oren_nayar": lambda q, v: (
        v["kd"] * (1 - 0.5 * v["sigma"] ** 2 / (v["sigma"] ** 2 + 0.33))
        + v["kd"]
        * (0.45 * v["sigma"] ** 2 / (v["sigma"] ** 2 + 0.09))
        * q["side"].clamp(min=0)
        / torch.maximum(q["i"], q["o"])
    ),
    "oren_nayar(energy_preserving)": _eon_weight,
}


@pytest.mark.parametrize("choice", EVERY_CHOICE, ids=CHOICE_IDS)
def test_weights_are_the_papers(choice):
    rng = np.random.default_rng(31)
    for theta in (0.0, 40.0, 75.0):
        material = material_of(choice, draw_values(choice, rng, where="mild"))
        wo = direction(theta, 70)
        wi = sampled(material, wo, 500, 3)
        wi = wi[wi[:, 2] > 1e-3]
        assert len(wi) > 50
        v = {key.split(".")[1]: value.detach() for key, value in material.values().items()}
        expected = entry(PAPER_WEIGHT, choice)(_quantities(wi, wo, v), v)
        weight = material.weight(wi, wo)[:, 0].detach()
        ratio = material.f(wi, wo)[:, 0].detach() * wi[:, 2] / material.pdf(wi, wo).detach()
        assert float((weight / ratio - 1).abs().max()) <= 1e-14
        assert float((weight / expected - 1).abs().max()) <= (1e-7 if "compensated" in choice.options else 1e-10)


@pytest.mark.parametrize("text", SUMS)
def test_weights_of_sums_use_the_mixture(text):
    material, wo = bc.material(text), direction(50, 70)
    wi = sampled(material, wo, 500, 4)
    pdf = material.pdf(wi, wo).detach()
    weight = material.weight(wi, wo).detach()
    expected = material.f(wi, wo).detach() * wi[:, 2:] / pdf.clamp(min=1e-300)[:, None]
    assert torch.allclose(weight, torch.where(pdf[:, None] > 0, expected, 0.0), rtol=1e-12, atol=0)


@pytest.mark.parametrize("text", SUMS)
def test_the_mixture_is_the_shared_out_density_of_the_terms(text):
    """pdf = sum of share * pdf of the term, with shares that are positive where a term reflects and sum to 1."""
    material = bc.material(text)
    shares = material.form.shares(material.values())
    assert not shares.requires_grad
    assert float(shares.sum()) == pytest.approx(1, rel=1e-14)
    wi, wo = hemisphere(np.random.default_rng(32), 50), hemisphere(np.random.default_rng(33), 50)
    total = torch.zeros(50, dtype=torch.float64)
    for share, term in zip(shares, material.form.terms, strict=True):
        values = {f"{term.model.name}.{k}": v for k, v in material.form.of_term(term, material.values()).items()}
        values = {k: v.mean() if v.ndim else v for k, v in values.items()}
        alone = form_of(term.model)
        total += share * bc.Material(alone, {k: v.detach() for k, v in values.items()}).pdf(wi, wo).detach()
    assert torch.allclose(material.pdf(wi, wo).detach(), total, rtol=1e-12, atol=0)


def albedo_cases(choices: list[bc.Model], thetas: tuple[float, ...]) -> list[Any]:
    """Materials of every choice and sum, each at the next of the angles."""
    of_choices = {name_of(c): functools.partial(shaped, c, 0.5 if k % 4 < 2 else 0.85) for k, c in enumerate(choices)}
    made = of_choices | {text: functools.partial(bc.material, text) for text in SUMS[:-1]}
    turns = itertools.cycle(thetas)
    return [pytest.param(make, t := next(turns), id=f"{name}-{t}") for name, make in made.items()]


def check_the_mean_weight(material: bc.Material, theta: float, count: int, widest: float, level: float) -> None:
    """The mean weight of samples is the albedo by quadrature, within an interval of at most `widest` times that."""
    wo = direction(theta, 25)
    wi = sampled(material, wo, count, 5)
    weight = material.weight(wi, wo).detach()[:, -1]
    cells = cells_of(wi[:20_000])
    albedo = float(cells.integrate(lambda wi: material.f(wi, wo)[:, -1] * wi[:, 2], 1e-6).sum())
    interval = stats.norm.isf(level / 2) * float(weight.std()) / math.sqrt(count)
    assert albedo > 0
    assert interval <= widest * albedo, "the interval is narrow enough to mean something"
    assert abs(float(weight.mean()) - albedo) <= interval + 1e-4 * albedo


SOME_ALBEDOS = albedo_cases(COVERING, (10.0, 75.0))
EVERY_ALBEDO = albedo_cases(CHOICES, (10.0,)) + albedo_cases(CHOICES, (75.0,))


@pytest.mark.parametrize(("make", "theta"), SOME_ALBEDOS)
def test_the_mean_weight_is_the_albedo(make, theta):
    check_the_mean_weight(make(), theta, COUNT["default"], 0.06, sidak(LEVEL, len(SOME_ALBEDOS)))


@pytest.mark.full
@pytest.mark.parametrize(("make", "theta"), EVERY_ALBEDO)
def test_the_mean_weight_is_the_albedo_in_full(make, theta):
    check_the_mean_weight(make(), theta, COUNT["full"], 0.01, sidak(LEVEL, len(EVERY_ALBEDO)))


# --- ends ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", DTYPES, ids=["float32", "float64"])
@pytest.mark.parametrize("choice", EVERY_CHOICE, ids=CHOICE_IDS)
def test_the_ends_of_u_give_unit_directions(choice, dtype):
    """0, the largest float32 below 1 and the largest number below 1, in every corner of the box; no NaN anywhere.

    From the normal to grazing; derivatives by the values and by wo included.
    """
    largest = float(torch.nextafter(torch.ones((), dtype=dtype), torch.zeros((), dtype=dtype)))
    ends = (0.0, 2.0**-60, 0.25, 0.5, 0.75, 1 - 2.0**-24, largest)
    u = torch.tensor(list(itertools.product((0.0, largest), ends, ends)), dtype=torch.float64).to(dtype)
    assert float(u.max()) < 1
    directions = [direction(t, p) for t, p in (*DIRECTIONS, (90 - 1e-10, 10))]
    wo = torch.stack([*directions, *directions, *(direction(t, 20) for t in (1e-9, 1e-3))]).to(dtype)
    wo[len(directions) : 2 * len(directions), 2] *= torch.tensor([1, -1, 0, 1, 1], dtype=dtype)
    wo = torch.cat([wo, torch.tensor([[1.0, 0.0, 1e-30]], dtype=dtype)]).requires_grad_()
    for corner in corners(choice, shapes_only=True):
        material = material_of(choice, corner)
        wi = material.sample(wo[:, None], u)
        if wi.requires_grad:  # cosine-distributed samples depend on nothing
            slopes = torch.autograd.grad(wi.sum(), [wo, *material.parameters()], allow_unused=True)
            assert not any(slope is not None and slope.isnan().any() for slope in slopes), corner
        wi = wi.detach()
        assert wi.isfinite().all(), corner
        assert float((wi.norm(dim=-1) - 1).abs().max()) <= 16 * torch.finfo(dtype).eps, corner
        weight = material.weight(wi, wo[:, None]).detach()
        assert not weight.isnan().any(), corner
        assert bool((weight >= 0).all())
        assert bool((weight[(wi[..., 2] <= 0) | (wo[:, None, 2] <= 0)] == 0).all())


def test_double_precision_u_with_single_precision_directions():
    """u just below 1 in float64 rounds to 1 in float32; the sample must still be a direction."""
    u = torch.tensor([[1 - 1e-12, 0.3, 0.3], [0.3, 1 - 1e-12, 0.3], [0.3, 0.3, 1 - 1e-12]], dtype=torch.float64)
    wo = direction(30, 0).float()
    for choice in CHOICES:
        wi = material_of(choice).sample(wo, u)
        assert wi.dtype == torch.float32
        assert not wi.isnan().any(), choice


@pytest.mark.parametrize("choice", EVERY_CHOICE, ids=CHOICE_IDS)
def test_directions_below_the_horizon_have_no_density_and_no_weight(choice):
    material = material_of(choice, {})
    wo = direction(80, 0)
    wi = sampled(material, wo, 2000, 6) * torch.tensor([1.0, 1.0, -1.0], dtype=torch.float64)
    below = wi[:, 2] <= 0
    assert bool(below.any())
    assert bool((material.pdf(wi, wo)[below] == 0).all())
    assert bool((material.weight(wi, wo)[below] == 0).all())


@pytest.mark.parametrize("text", ["lambert", "ward", "lambert + ward"])
def test_one_u_serves_many_directions_and_one_direction_many_u(text):
    material = bc.material(text)
    many, one = torch.tensor([[0.6, 0.0, 0.8]]).repeat(5, 1), torch.tensor([0.5, 0.2, 0.7])
    assert material.sample(many, one).shape == (5, 3)
    assert material.sample(many[0], one.repeat(5, 1)).shape == (5, 3)
