"""The certificate: the papers' claims of energy and reciprocity, right and wrong, and its own against dense scans."""

import json
import math

import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import brdfcore as bc
from brdfcore.energy import peak
from brdfcore.energy.albedo import of_form
from brdfcore.energy.scan import Scan, lone_terms
from brdfcore.geometry import from_angles
from brdfcore.models.form import Form, Term

WIDE = (0.05, 0.5, 2.0, 10.0)


def certified(text: str, **more) -> bc.Certificate:
    return bc.certify(bc.material(text), **more)


def seen(material: bc.Material, cosine: torch.Tensor, azimuth: torch.Tensor, tolerance: float = 1e-7) -> torch.Tensor:
    """Albedos by the cosine of the polar angle, which may be as good as 0."""
    with torch.no_grad():
        return of_form(material.form, material.values(), cosine, azimuth, tolerance).values


def albedo(material: bc.Material, theta: float, phi: float = 0.0) -> torch.Tensor:
    cosine, azimuth = torch.tensor([max(math.cos(theta), 1e-12), phi], dtype=torch.float64)
    return seen(material, cosine, azimuth)


# --- what the papers say --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "exponent", "beyond"),
    [
        ("ward(rs=1, a=0.1)", 0.5, 89.993),  # G-M&D Fig. 6
        ("ward_duer(rs=1, a=0.1)", 1.0, 85.6),  # G-M&D Fig. 6
        ("kurt(constant, ks=1, m=0.35, alpha=0.25)", 0.25, None),  # Kurt eq. 10, "physically plausible"
    ],
)
def test_lobes_that_diverge(text, exponent, beyond):
    found = certified(text)
    assert math.isinf(found.max_albedo)
    assert math.isinf(found.grazing_limit)
    assert found.grazing_exponent == pytest.approx(exponent, abs=1e-12)
    assert found.at_theta == math.pi / 2
    assert not found.energy_conserving
    assert found.decided
    assert "has no limit" in found.verdict
    if beyond is not None:
        digits = len(str(beyond).partition(".")[2])
        assert round(math.degrees(found.exceeds[0]), digits) == beyond
        assert f"beyond {beyond} degrees" in found.verdict
    assert found.exceeds[1] == math.pi / 2


def test_kurts_bound_of_alpha_is_none():
    """Kurt eq. 8, f <= F D / (4 (h.wo) ci), at equality: kurt with alpha = 1 at normal incidence; checked: 1.086."""
    lobe = bc.material("kurt(constant, ks=1, m=0.5, alpha=1)")
    assert float(albedo(lobe, 0.0)) == pytest.approx(1.086, abs=5e-4)
    found = bc.certify(lobe)
    assert found.exceeds[0] == 0
    assert "already at normal incidence" in found.verdict


@pytest.mark.parametrize(("m", "at_89_9"), [(2.0, 1.04), (2.64, 1.30), (3.0, 1.44)])
def test_kurts_equation_9_is_not_plausible_for_rough_lobes(m, at_89_9):
    """Kurt eq. 9, "produces a physically plausible BRDF"; checked: these albedos at 89.9 degrees."""
    lobe = bc.material(f"kurt_plausible(constant, ks=1, m={m})")
    assert float(albedo(lobe, math.radians(89.9))) == pytest.approx(at_89_9, abs=6e-3)
    found = bc.certify(lobe)
    assert not found.energy_conserving
    assert found.grazing_exponent == 0
    assert found.max_albedo >= found.grazing_limit - found.error > at_89_9 - 6e-3
    assert "has no limit" not in found.verdict


@pytest.mark.parametrize("alpha", [1e-6, 0.005, 0.7, 1.0])
@pytest.mark.parametrize("widths", ["m=0.001", "m=10", "mx=0.01, my=1"])
def test_every_alpha_above_0_diverges(widths, alpha):
    """Kurt eq. 10, "if m and alpha are correctly chosen, physically plausible as well"."""
    found = certified(f"lambert(kd=0.2) + kurt(ks=0.01, f0=0.04, {widths}, alpha={alpha})", tolerance=1e-3)
    assert found.grazing_exponent == pytest.approx(alpha, rel=1e-6)
    assert not found.energy_conserving


@pytest.mark.parametrize("widths", ["m=0.05", "m=0.5", "m=2", "m=10", "mx=0.01, my=3", "mx=10, my=0.3"])
def test_kurts_lobe_with_alpha_0_conserves_energy(widths):
    """Checked to m = 10, isotropic and anisotropic."""
    found = certified(f"kurt(constant, ks=1, {widths}, alpha=0)", tolerance=1e-5)
    assert found.energy_conserving
    assert found.max_albedo <= 1
    assert found.grazing_exponent == 0


@pytest.mark.parametrize("widths", ["a=0.01", "a=1", "ax=0.02, ay=0.5"])
def test_the_bounded_lobe_is_bounded(widths):
    """G-M&D section 4: at most rs, and rs in the limit towards grazing, which is approached slowly."""
    found = certified(f"ward_bounded(rs=1, {widths})")
    assert found.max_albedo == pytest.approx(1, abs=2e-6)
    assert found.grazing_limit == pytest.approx(1, abs=2e-6)
    assert found.energy_conserving
    assert found.reciprocal


@pytest.mark.parametrize(
    "text",
    [
        "ashikhmin_shirley(f0=1, nu=10, nv=1000)",
        "ashikhmin_shirley(f0=0.05, n=1) + ashikhmin_shirley_diffuse(kd=1, f0=ashikhmin_shirley.f0)",
        "ward_neumann(rs=1, a=0.3)",
        "ashikhmin_premoze(constant, ks=1, a=0.5)",
        "cook_torrance(constant, ks=1, a=0.5)",
        "ggx(constant, separable, ks=1, a=0.4)",
        "beckmann(constant, ks=1, a=0.5)",
        "lambert(kd=1)",
        "oren_nayar(energy_preserving, kd=1, sigma=0.8)",
    ],
)
def test_what_conserves_energy(text):
    found = certified(text, tolerance=1e-5)
    assert found.energy_conserving
    assert found.exceeds is None
    assert found.verdict.startswith("Conserves energy: the largest albedo is ")
    assert found.reciprocal
    assert found.min_value >= 0


def test_edwardss_lobe_is_not_reciprocal():
    """Edwards 2006: energy-conserving, 1.000 at normal incidence; where the exchanged pair is off the lump, f is 0."""
    found = certified("edwards(ks=1)")
    assert found.max_albedo == pytest.approx(1, abs=1e-6)
    assert found.energy_conserving
    assert found.reciprocity_error == 1
    assert not found.reciprocal
    assert found.verdict.endswith("Not reciprocal: exchanging the directions changes f by up to 100 %.")
    diluted = certified("lambert(kd=0.9) + edwards(ks=0.01)")
    assert 1e-3 < diluted.reciprocity_error < 1


# --- towards grazing ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "exponent"),
    [
        ("lambert(kd=0.5) + ward(rs=1e-9, a=0.1)", 0.5),  # f's own growth tells it where the sum hardly grows
        ("ward(rs=0.1, a=0.0001)", 0.5),
        ("ward_duer(rs=0.1, a=10)", 1.0),
        ("ward(rs=0.1, a=0.1) + ward_duer(rs=1e-6, a=0.1) + kurt(alpha=0.7)", 1.0),  # the largest of the terms
        ("lambert(kd=0.5) + ward_duer(rs=0) + kurt(ks=0, alpha=1)", 0.0),  # what reflects nothing does not grow
        ("coupled_lambert(kd=1, f0=0.999999999)", 0.0),  # next to nothing, and exact to no digit
        ("kurt(alpha=0)", 0.0),
        ("edwards", 0.0),  # f falls as cos^2 for a fixed wi while its integral has a limit
        ("ashikhmin_shirley_diffuse", 0.0),
        ("lambert(kd=[0, 0.5]) + ward(rs=[0.1, 0], a=0.2)", 0.5),
    ],
)
def test_exponents(text, exponent):
    found = certified(text, tolerance=1e-3)
    assert found.grazing_exponent == pytest.approx(exponent, abs=1e-9)
    assert math.isinf(found.grazing_limit) == (exponent > 0)


@pytest.mark.parametrize("text", ["ward(a=0.02)", "ward_duer(ax=0.1, ay=0.5)", "kurt(m=0.5, alpha=0.37)"])
def test_the_exponent_is_the_integrals(text):
    """The albedo itself, over two decades, to 1e-3."""
    material = bc.material(text)
    low, lower = (seen(material, torch.tensor(cosine).double(), torch.tensor(0.3), 1e-4) for cosine in (1e-8, 1e-10))
    told = float(torch.log(lower / low)) / math.log(100)
    assert bc.certify(material, tolerance=1e-3).grazing_exponent == pytest.approx(told, abs=1e-3)


# --- the maximum ----------------------------------------------------------------------------------------------------

MAXIMA = [
    "lambert(kd=0.3) + lafortune(ks=0.4, cx=-1.1, cy=-1.1, n=20)",  # inside, isotropic
    "lafortune(ks=0.4, cx=-1.1, cy=0.3, n=20)",  # inside, along x
    "lafortune(ks=0.4, cx=0.5, cy=1.2, n=5) + ward_bounded(rs=0.3, ax=0.3, ay=0.05)",  # inside, along y
    "ashikhmin_shirley(isotropic, constant, ks=0.7236, n=7.51)",  # between steps of the scan that differ
    "lambert(kd=[0.1, 0.5, 0.2]) + ggx(ks=[0.7, 0.1, 0.5], f0=0.9, a=0.4)",
    "ward_bounded(rs=0.5, ax=0.02, ay=0.3) + ashikhmin_shirley(f0=0.3, nu=1000, nv=5)",
]


def dense(material: bc.Material, angles: int = 40, azimuths: int = 9, tolerance: float = 1e-5) -> torch.Tensor:
    """Albedos over a grid that has nothing in common with the certificate's, (U, S, C)."""
    steep, grazing = torch.linspace(1, 0.03, angles), torch.logspace(-2, -9, angles // 4)
    cosine = torch.cat([steep, grazing]).double().unsqueeze(-1)
    return seen(material, cosine, torch.linspace(0, math.pi / 2, azimuths, dtype=torch.float64), tolerance)


@pytest.mark.parametrize("text", MAXIMA)
def test_the_maximum_is_a_dense_scans(text):
    material = bc.material(text)
    found = bc.certify(material)
    assert found.error <= found.tolerance
    largest = float(dense(material).max())
    assert largest - 1e-5 <= found.max_albedo <= largest + 4e-3  # which the scan's steps leave
    there = albedo(material, found.at_theta, found.at_phi)
    assert float(there[found.channel]) == pytest.approx(found.max_albedo, abs=1e-6)


LEVEL = [  # ks, and a lump whose albedo is ks as far as the disk holds it, whose edge each azimuth meets elsewhere
    (0.818480843661, "rx=0.0574631633064, ry=0.0234770099383, n=1.12094139283"),
    (0.95, "rx=0.14, ry=0.043, n=1.9"),
]


@pytest.mark.parametrize(("ks", "lump"), LEVEL)
def test_the_edge_of_a_level_albedo_leaves_no_doubt(ks, lump):
    """No polynomial fits there."""
    found = certified(f"edwards(ks={ks}, {lump})", tolerance=1e-5)
    assert found.error <= 1e-5
    assert found.max_albedo == pytest.approx(ks, abs=1e-5)


def test_what_is_too_dear_to_be_looked_at_counts_as_error(monkeypatch):
    monkeypatch.setattr(peak, "DEAREST", 0)
    assert 1e-3 < certified(f"edwards({LEVEL[1][1]})", tolerance=1e-5).error < 1


def test_a_direction_is_integrated_once():
    """At the normal every azimuth is the same."""
    material = bc.material("ggx(ax=0.1, ay=0.3)")
    scan = Scan(lone_terms(material.form, {key: value.detach() for key, value in material.values().items()}), 1)
    one = scan.albedos(torch.zeros(1).double(), scan.s[:1], 1e-3)[0]
    cost = scan.evaluations
    every = scan.albedos(torch.zeros_like(scan.s), scan.s, 1e-3)[0]
    assert scan.evaluations == 2 * cost
    assert every.tolist() == one.expand_as(every).tolist()


def test_of_the_last_row_only_what_may_be_its_largest_is_settled():
    """A regression number: 2.7e6 if all of it is, for a lobe that is largest towards grazing along its narrow axis."""
    assert certified("ggx(ax=0.1, ay=0.3)").evaluations < 2.5e6


@pytest.mark.parametrize("text", MAXIMA[:3])
def test_the_maximum_is_what_samples_weigh(text):
    """Monte Carlo shares no rule with the quadrature."""
    material = bc.material(text)
    found = bc.certify(material)
    wo = from_angles(*torch.tensor([found.at_theta, found.at_phi], dtype=torch.float64))
    worth = bc.sampling.efficiency(material, wo, count=2**17)
    at = found.channel if material.channels > 1 else 0
    assert float(worth.mean[at]) == pytest.approx(found.max_albedo, abs=4.5 * float(worth.standard_error[at]))


def drawn(choice: bc.Model, number: int) -> bc.Material:
    """A material of a diffuse term and the model with values from its search ranges, its reflectances high."""
    rng = np.random.default_rng(number)
    values = {}
    for parameter in choice.parameters:
        low, high = parameter.search_range
        share = rng.uniform(0.5, 1) if parameter.name == choice.scale else rng.uniform()
        log = parameter.scale == "log"
        values[parameter.name] = (
            math.exp(math.log(low) + share * math.log(high / low)) if log else low + share * (high - low)
        )
    lobe = Form((Term(choice.name, choice),))
    return bc.Material(lobe, {f"{choice.name}.{name}": value for name, value in values.items()})


EVERY = st.sampled_from([choice for model in bc.MODELS.values() for choice in model.with_words(())])


@settings(max_examples=10, suppress_health_check=[HealthCheck.too_slow])
@given(choice=EVERY, number=st.integers(0, 2**31))
def test_no_dense_scan_contradicts_a_certificate(choice, number):
    contradict(choice, number, 16, 4)


@pytest.mark.full
@settings(max_examples=500, suppress_health_check=[HealthCheck.too_slow])
@given(choice=EVERY, number=st.integers(0, 2**31))
def test_no_dense_scan_contradicts_a_certificate_in_many_cases(choice, number):
    contradict(choice, number, 60, 13)


def test_the_limit_of_a_lopsided_lobe_with_separable_masking_is_found():
    found = bc.certify(bc.material("ggx(separable, schlick, anisotropic, ks=0.897, f0=0.136, ax=0.061, ay=1.204)"))
    assert found.error <= found.tolerance
    assert found.evaluations < 4e6  # of 4e7 without rays that are dense where its masking changes


def contradict(choice: bc.Model, number: int, angles: int, azimuths: int) -> None:
    """Hold a certificate against a scan that may be denser."""
    material = drawn(choice, number)
    found = bc.certify(material, tolerance=1e-5)
    largest = float(dense(material, angles, 1 if found.isotropic else azimuths, 1e-4).max())
    assert found.error <= 1e-5 * max(1.0, found.max_albedo), str(material)  # lafortune's may be 1e123
    assert found.max_albedo >= largest * (1 - 1e-4) - 1e-4, str(material)
    assert largest <= 1 + 2e-4 or not found.energy_conserving, str(material)
    assert found.reciprocal or not choice.reciprocal, str(material)
    assert found.min_value >= 0
    assert not math.isnan(found.max_albedo + found.grazing_limit + found.error)


# --- what is said ---------------------------------------------------------------------------------------------------


def certificate(**facts) -> bc.Certificate:
    """A certificate of Lambert's term, with other facts."""
    plain = {
        "max_albedo": 0.2,
        "at_theta": 0.0,
        "at_phi": 0.0,
        "channel": 0,
        "error": 1e-9,
        "grazing_limit": 0.2,
        "grazing_exponent": 0.0,
        "exceeds": None,
        "largest_before": 0.2,
        "reciprocity_error": 0.0,
        "min_value": 0.1,
        "pairs": 900,
        "tolerance": 1e-6,
        "isotropic": True,
        "channels": 1,
        "evaluations": 0,
        "seconds": 0.0,
    }
    return bc.Certificate(**{**plain, **facts})


HORIZON = math.pi / 2
DIVERGENT = {"max_albedo": math.inf, "at_theta": HORIZON, "grazing_limit": math.inf, "error": 0.0}
VERDICTS = {
    "Conserves energy: the largest albedo is 0.2, at normal incidence.": {},
    "Conserves energy: it reflects nothing.": {"max_albedo": 0.0},
    "Conserves energy: the largest albedo is 0.2, in the limit towards grazing.": {"at_theta": HORIZON},
    "Conserves energy: the largest albedo is 0.2, at 89.93 degrees and azimuth 90 in channel 2 of 3.": {
        "at_theta": math.radians(89.93),
        "at_phi": HORIZON,
        "isotropic": False,
        "channel": 1,
        "channels": 3,
    },
    "Conserves energy: the largest albedo is 0.2, at normal incidence in channel 550 nm.": {
        "channel": 1,
        "channels": 2,
        "channel_names": ("450 nm", "550 nm"),
    },
    "Not decided: the largest albedo is 0.999 to within 0.01, at normal incidence.": {
        "max_albedo": 0.999,
        "error": 0.01,
    },
    "Reflects more than it receives beyond 85.6 degrees: the albedo grows like 1/cos^0.25 theta and has no limit.": {
        **DIVERGENT,
        "grazing_exponent": 0.25,
        "exceeds": (math.radians(85.6), HORIZON),
    },
    "Reflects more than it receives within 6e-08 degrees of the horizon: the albedo grows like 1/cos theta and has no "
    "limit.": {**DIVERGENT, "grazing_exponent": 1.0, "exceeds": (HORIZON - 1e-9, HORIZON)},
    "Reflects more than it receives in the limit towards grazing only: the albedo grows like 1/cos^0.005 theta and has "
    "no limit, but it is at most 0.35 up to 6e-11 degrees from the horizon.": {
        **DIVERGENT,
        "grazing_exponent": 0.005,
        "exceeds": (HORIZON, HORIZON),
        "largest_before": 0.35,
    },
    "Reflects more than it receives already at normal incidence: the albedo grows like 1/cos^0.5 theta and has no "
    "limit.": {
        **DIVERGENT,
        "grazing_exponent": 0.5,
        "exceeds": (0.0, HORIZON),
    },
    "Reflects more than it receives between 30.0 and 80.5 degrees: the largest albedo is 1.447, at 60.0 degrees.": {
        "max_albedo": 1.4468,
        "at_theta": math.radians(60),
        "exceeds": (math.radians(30), math.radians(80.5)),
    },
    "Reflects more than it receives up to 80.5 degrees: the largest albedo is more than 1e308.": {
        "max_albedo": math.inf,
        "at_theta": math.radians(60),
        "exceeds": (0.0, math.radians(80.5)),
    },
    "Conserves energy: the largest albedo is 0.2, at normal incidence. Not reciprocal: exchanging the directions "
    "changes f by up to 12.3 %.": {"reciprocity_error": 0.123},
}


@pytest.mark.parametrize("verdict", VERDICTS)
def test_verdicts_are_plain_sentences(verdict):
    assert certificate(**VERDICTS[verdict]).verdict == verdict


def test_a_doubtful_certificate_does_not_say_that_energy_is_conserved():
    assert certificate(max_albedo=1 + 5e-7, error=1e-9).energy_conserving  # within the tolerance
    assert not certificate(max_albedo=1 + 2e-6, error=1e-9).energy_conserving
    doubtful = certificate(max_albedo=0.999, error=0.01)
    assert not doubtful.energy_conserving
    assert not doubtful.decided
    assert certificate(max_albedo=0.9, error=0.01).energy_conserving


@pytest.mark.parametrize("text", ["lambert", "ward(ax=0.1, ay=0.3)"])
def test_a_certificate_is_json(text):
    found = certified(text, tolerance=1e-3).to_dict()
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert (found["max_albedo"] is None) == (text != "lambert")
    assert found["at_theta_deg"] == (0 if text == "lambert" else 90)
    assert found["exceeds_deg"] is None or 80 < found["exceeds_deg"][0] < found["exceeds_deg"][1] == 90


def test_mistakes_are_one_sentence():
    with pytest.raises(bc.errors.InvalidValueError, match=r"^Expected material to be a Material, got str\. Make one"):
        bc.certify("lambert")
    for tolerance in (0, 1.0, math.nan):
        with pytest.raises(bc.errors.InvalidValueError, match=r"^Expected tolerance to be in \(0, 0\.1\], got"):
            certified("lambert", tolerance=tolerance)
