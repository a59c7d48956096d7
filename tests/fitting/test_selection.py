"""What `model="auto"` and lists of texts choose, and what the ladder says of it."""

import functools
import json
import pathlib
import time
from collections import Counter

import pytest
import torch
from fit_cases import TRUE, directions, measured_from
from generated_materials import Generated, chosen, generated, geometry, of, parts, shows

import brdfcore as bc
from brdfcore.demo import DATA
from brdfcore.errors import BrdfError, ModelTextError, UnknownNameError
from brdfcore.fitting import check
from brdfcore.fitting.effects import Effects

EFFECTS = ("diffuse", "lobe", "Fresnel", "anisotropy", "second lobe")


def noisy(text: str, where: bc.Samples, seed: int = 0) -> bc.Samples:
    f = of(text, where)
    noise = torch.randn(f.shape, generator=torch.Generator().manual_seed(seed), dtype=f.dtype)
    return bc.Samples(where.wi, where.wo, f * (1 + 0.02 * noise))


SMALL = {
    "diffuse": (Effects(), "lambert(kd=0.4)"),
    "diffuse, turned": (Effects(), "lambert(kd=0.05)"),
    "lobe": (Effects(lobes=1), "lambert(kd=0.3) + ggx(constant, ks=0.2, a=0.15)"),
    "lobe alone": (Effects(diffuse=False, lobes=1), "ggx(constant, ks=0.5, a=0.3)"),
    "Fresnel": (Effects(lobes=1, fresnel=True), "lambert(kd=0.1) + ggx(ks=0.5, f0=0.1, a=0.2)"),
    "anisotropy, turned": (
        Effects(lobes=1, anisotropic=True),
        "lambert(kd=0.2) + ggx(constant, ks=0.3, ax=0.1, ay=0.25)",
    ),
    "second lobe": (
        Effects(lobes=2),
        "lambert(kd=0.2) + ggx(constant, ks=0.1, a=0.08) + ggx(constant, ks=0.4, a=0.4)",
    ),
    "all, crossed, turned": (
        Effects(lobes=2, fresnel=True, anisotropic=True),
        "lambert(kd=0.27) + ggx(ks=0.56, f0=0.08, ax=0.23, ay=0.62) + ggx(ks=0.086, f0=0.23, ax=0.4, ay=0.11)",
    ),
}


@functools.cache
def automatic(name: str) -> bc.Fit:
    return bc.fit(noisy(SMALL[name][1], geometry(turned="turned" in name)), "auto")


@pytest.mark.parametrize("name", SMALL)
def test_auto_finds_what_is_there_and_nothing_else(name: str) -> None:
    """The short form of the 200 materials below: one of each kind."""
    effects, _ = SMALL[name]
    fit = automatic(name)
    assert chosen(fit) == parts(effects), fit.report()
    kept = [rung for rung in fit.ladder if rung.kept]
    assert kept[-1].model == fit.ladder[-1].model or kept[-1].error <= fit.ladder[0].error
    assert fit.model == bc.material(kept[-1].model).form.text()


@pytest.mark.full
@pytest.mark.parametrize("slice_", range(10))
def test_auto_on_generated_materials(slice_: int) -> None:
    """200 materials of 2 % noise in slices of 20: hardly an effect is missed, or chosen where it is absent.

    That is the bar for the whole, 95 % of present effects found and 2 % of absent ones chosen, for a slice's numbers.
    """
    seen: Counter[tuple[str, bool, bool]] = Counter()
    for seed in range(20 * slice_, 20 * slice_ + 20):
        made: Generated = generated(seed)
        there, found = parts(made.effects), chosen(bc.fit(made.samples, "auto"))
        for effect in EFFECTS:
            if effect != "anisotropy" or made.samples.azimuth_observed:
                seen[effect, there[effect], found[effect]] += 1
    print({f"{e} present={p} chosen={c}": n for (e, p, c), n in sorted(seen.items())})
    present = sum(n for (_, there, _), n in seen.items() if there)
    absent = sum(n for (_, there, _), n in seen.items() if not there)
    assert sum(n for (_, there, found), n in seen.items() if there and not found) <= 0.05 * present
    assert sum(n for (_, there, found), n in seen.items() if found and not there) <= max(1, 0.02 * absent)


def test_generated_materials_show_their_effects() -> None:
    where = geometry(turned=True)
    flat = "lambert(kd=0.2) + ggx(constant, ks=0.3, ax=0.2, ay=0.201)"
    assert not shows(Effects(lobes=1, anisotropic=True), of(flat, where), where)
    clear = "lambert(kd=0.2) + ggx(constant, ks=0.3, ax=0.2, ay=0.4)"
    assert shows(Effects(lobes=1, anisotropic=True), of(clear, where), where)


@pytest.mark.parametrize("channels", [1, 3])
def test_matte_data_are_quick_and_never_see_a_lobe_in_the_end(channels: int) -> None:
    kd = 0.2 if channels == 1 else [0.2, 0.3, 0.4]
    samples = noisy(f"lambert(kd={kd})", geometry(turned=False))
    begun = time.perf_counter()
    fit = bc.fit(samples, "auto")
    assert time.perf_counter() - begun < 2
    assert [term.label for term in fit.form.terms] == ["lambert"]
    assert [rung.effect for rung in fit.ladder] == ["diffuse", "lobe", "lobe + Fresnel"]


def test_the_ladder_is_in_the_result_and_says_why_it_stopped() -> None:
    fit = automatic("lobe")
    tried = {rung.effect: rung for rung in fit.ladder}
    assert list(tried)[:3] == ["diffuse", "lobe", "Fresnel"]
    assert tried["lobe"].kept
    assert not tried["Fresnel"].kept
    assert tried["lobe"].criterion < 0 < tried["second lobe"].criterion
    assert tried["lobe"].held_out < tried["diffuse"].held_out
    assert tried["lobe"].parameters == 3
    assert sum(rung.seconds for rung in fit.ladder) < fit.cost.seconds
    assert "the held-out error falls (" in tried["lobe"].reason
    assert tried["lobe"].reason.endswith(": it stays.")
    assert tried["Fresnel"].reason.endswith(": it is left out.")
    assert "The ladder ends at lambert + ggx(isotropic, constant): the data call for no " in fit.report()
    assert "Anisotropy was not tried, for the sample's azimuth was not observed." in fit.choices[-1]
    result = json.loads(json.dumps(fit.to_dict(), allow_nan=False))
    assert [rung["effect"] for rung in result["ladder"]] == [rung.effect for rung in fit.ladder]
    assert result["ladder"][0]["criterion"] is None
    (line,) = [line for line in fit.report().splitlines() if line.startswith("Fresnel  ")]
    assert line.endswith("no")
    assert bc.fit(measured_from(TRUE), "lambert").ladder == ()


def test_every_rung_is_no_worse_than_the_one_it_contains() -> None:
    """Each begins where the leaner one ended too."""
    fit = automatic("all, crossed, turned")
    leaner = fit.ladder[0].error
    for rung in fit.ladder[1:]:
        if not rung.effect.startswith("without") and not rung.effect.endswith("shape"):
            assert rung.error <= leaner * (1 + 1e-9), rung.effect
            leaner = rung.error if rung.kept else leaner


def test_a_list_is_chosen_from_by_the_same_rule() -> None:
    samples = measured_from(TRUE, noise=0.01)
    texts = ["lambert + ward_bounded + ward_bounded", "lambert", "lambert + ward", "lambert + ward_bounded(isotropic)"]
    fit = bc.fit(samples, texts)
    assert fit.model == "lambert + ward_bounded(isotropic)"
    assert [rung.model for rung in fit.ladder] == [texts[1], texts[3], texts[2], texts[0]]
    assert [rung.kept for rung in fit.ladder] == [True, True, False, False]
    assert fit.choices[-1] == "Of 4 models the data call for lambert + ward_bounded(isotropic)."
    assert fit.objective == pytest.approx(bc.fit(samples, texts[3]).objective, rel=1e-9)


def test_keywords_concern_the_materials_that_have_them() -> None:
    samples = measured_from(TRUE, noise=0.01)
    texts = ["lambert", "lambert + ward_bounded(isotropic)"]
    fit = bc.fit(samples, texts, fixed={"ward_bounded.a": 0.12}, gray=["lambert.kd"], bounds={"lambert.kd": (0, 0.5)})
    assert fit.fixed == ("ward_bounded.a",)
    assert fit.gray == ("lambert.kd",)
    started = bc.fit(samples, texts, starts=[{"ward_bounded.a": 0.1}], loss="log", robust="soft_l1", max_theta=1.2)
    assert started.loss == "log"
    assert float(started.parameters["ward_bounded.a"]) == pytest.approx(0.12, rel=0.05)


def test_large_data_climb_on_a_part_and_end_on_all() -> None:
    wi, wo = directions(25_000, 5)
    samples = noisy("lambert(kd=0.3) + ggx(constant, ks=0.2, a=0.15)", bc.Samples(wi, wo, torch.zeros(25_000)))
    text = "lambert + ggx(isotropic, constant)"
    fit = bc.fit(samples, ["lambert", text])
    assert [term.label for term in fit.form.terms] == ["lambert", "ggx"]
    assert len(fit.samples) == 25_000
    assert fit.objective == pytest.approx(bc.fit(samples, text).objective, rel=1e-9)
    per_sample = fit.objective / 25_000
    assert per_sample != pytest.approx(fit.ladder[-1].error ** 2, rel=1e-6), "the rung saw a part"
    assert per_sample == pytest.approx(fit.ladder[-1].error ** 2, rel=0.1)


@pytest.mark.parametrize("value", [0.0, 1e-30, 1e30, -1.0])
def test_extreme_data_end_with_a_material_and_no_nan(value: float) -> None:
    wi, wo = directions(60, 0)
    fit = bc.fit(bc.Samples(wi, wo, torch.full((60, 1), value)), "auto")
    json.dumps(fit.to_dict(), allow_nan=False)
    assert all(bool(v.isfinite().all()) for v in fit.material.values().values())
    if value < 1:
        assert [term.label for term in fit.form.terms] == ["lambert"]


def test_fewer_than_two_samples_a_value_call_for_nothing() -> None:
    """Five points through which two lobes go exactly."""
    theta = torch.tensor([5.0, 20.0, 40.0, 55.0, 70.0])
    values = torch.rand(5, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    fit = bc.fit(bc.Samples.from_angles(theta, 0.0, theta + 3, 180.0, values, unit="degrees"), "auto")
    assert [term.label for term in fit.form.terms] == ["lambert"]
    assert "there are fewer than two samples a value to judge it by" in fit.ladder[-1].reason
    assert json.loads(json.dumps(fit.to_dict(), allow_nan=False))["ladder"][-1]["criterion"] is None


def test_progress_rises_to_one() -> None:
    seen: list[bc.Progress] = []
    bc.fit(noisy("lambert(kd=0.4)", geometry(turned=False)), "auto", progress=seen.append)
    fractions = [p.fraction for p in seen]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1
    assert {"ladder", "scan", "done"} <= {p.stage for p in seen}


REFUSED = {
    "empty list": ({"model": []}, ModelTextError, "model", 'a list of texts or "auto", got []'),
    "no texts": ({"model": ["lambert", 3]}, ModelTextError, "model", "Write each like 'lambert + ward'."),
    "auto in a list": ({"model": ["auto", "lambert"]}, ModelTextError, "model", "got ['auto', 'lambert']"),
    "unknown model": ({"model": ["lambert", "lambrt"]}, UnknownNameError, "model", "Did you mean 'lambert'"),
    "unknown key": ({"model": "auto", "fixed": {"lambert.kdd": 1}}, UnknownNameError, "fixed", "'lambert.kd'"),
    "unknown gray": ({"model": ["lambert", "ward"], "gray": ["kurt.ks"]}, UnknownNameError, "gray", "ward.rs"),
    "unknown start": ({"model": "auto", "starts": [{"ggx.aa": 1}]}, UnknownNameError, "starts", "'ggx.a'"),
    "bad value": ({"model": "auto", "fixed": {"ggx.ks": 2}}, BrdfError, "ggx.ks", "[0, 1]"),
    "loss": ({"model": "auto", "loss": "cosin"}, UnknownNameError, "loss", "'cosine'"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refusals_come_before_work(case: str) -> None:
    keywords, kind, field, part = REFUSED[case]
    samples = measured_from(TRUE, count=20)
    for call in (lambda: check(3, **keywords), lambda: bc.fit(samples, **keywords)):
        with pytest.raises(kind) as caught:
            call()
        assert caught.value.field == field
        assert part in str(caught.value)
        assert str(caught.value).startswith("Expected ")
    for call in (bc.fit_batch, bc.held_out):
        with pytest.raises(ModelTextError, match=r'^Expected model to be one text here, got "auto"'):
            call([samples] if call is bc.fit_batch else samples, "auto")
    assert check(3, "auto", fixed={"ggx.a": 0.2, "ggx_2.ax": 0.1}).free


def test_the_shape_is_chosen_last() -> None:
    """The demonstration's data are Ward's bounded lobe: neither ggx nor beckmann fits them to their sigma."""
    fit = bc.fit(bc.read(DATA), "auto")
    assert fit.model == "lambert + ward_bounded(isotropic)"
    assert fit.chi_square is not None
    assert fit.chi_square[0] < 1.2 * fit.chi_square[1]
    assert [rung.kept for rung in fit.ladder if rung.effect == "ward_bounded's shape"] == [True]


def flat_topped() -> bc.Samples:
    """Narrow peaks of a shape that no family has, flat and then falling as exp(-x^4), that grow towards grazing."""
    theta_i, theta_o = torch.arange(10.0, 81.0, 10.0), torch.arange(5.0, 81.0, 5.0)
    rows = torch.cartesian_prod(theta_i, theta_o, torch.tensor([0.0, 45, 90, 135, 165, 180])).double()
    where = bc.Samples.from_angles(rows[:, 0], 0.0, rows[:, 1], rows[:, 2], torch.zeros(len(rows)), unit="degrees")
    h = where.wi + where.wo
    slope = h[:, :2].norm(dim=1) / h[:, 2]
    fresnel = 0.04 + 0.96 * (1 - (where.wi * h).sum(1) / h.norm(dim=1)) ** 3
    f = 0.05 + 10 * fresnel * torch.exp(-((slope / 0.06) ** 4)) / (where.wi[:, 2] * where.wo[:, 2])
    noise = torch.randn(f.shape, generator=torch.Generator().manual_seed(0), dtype=f.dtype)
    return bc.Samples(where.wi, where.wo, f * (1 + 0.02 * noise))


def test_misfit_is_not_taken_for_noise() -> None:
    """No rung fits a shape that none has; the peaks that a lobe takes away are called for all the same."""
    fit = bc.fit(flat_topped(), "auto")
    least = min(rung.error for rung in fit.ladder)
    assert fit.ladder[0].error > 4 * least
    assert fit.errors["cosine_rms"] < 1.5 * least
    assert fit.errors["cosine_rms"] > 0.05, "and yet ten times the noise"
    assert chosen(fit)["lobe"]
    assert chosen(fit)["Fresnel"]


@pytest.mark.parametrize(
    ("paint", "lobes", "most"), [("cayman", 1, 0.07), pytest.param("garnet_red", 2, 0.05, marks=pytest.mark.full)]
)
def test_real_paints_get_the_lobes_that_they_have(paint: str, lobes: int, most: float, measured: pathlib.Path) -> None:
    """The error falls to the fraction `most` of Lambert's; peaks at grazing angles call for both only together."""
    fit = bc.fit(bc.read(measured / "cornell" / f"{paint}.brdf", quantity="brdf").to_rgb(), "auto")
    tried = {rung.effect: rung for rung in fit.ladder}
    assert fit.errors["cosine_rms"] < most * tried["diffuse"].error
    assert len(fit.form.terms) == 1 + lobes
    assert not tried["lobe"].kept
    assert tried["lobe + Fresnel"].kept


def test_one_incidence_does_not_decide_what_is_foretold(measured: pathlib.Path) -> None:
    """A lobe foretells seven of eight incidences of a paint better than Lambert's term, and the steepest one worse."""
    whole = bc.read(measured / "cornell" / "acryl_blue.brdf", quantity="brdf").to_rgb()
    paint = whole.subset(torch.arange(0, len(whole), 2))
    texts = ["lambert", "lambert + ggx(isotropic, constant)"]
    assert bc.held_out(paint, texts[1]).error > bc.held_out(paint, texts[0]).error
    fit = bc.fit(paint, texts)
    assert [rung.kept for rung in fit.ladder] == [True, True]
    assert fit.ladder[1].held_out < 0.7 * fit.ladder[0].held_out


def test_the_starts_of_a_result_are_those_that_were_asked_for() -> None:
    samples = measured_from(TRUE, count=60, noise=0.01)
    asked = [{"lambert.kd": 0.1}]
    assert bc.fit(samples, ["lambert", "lambert + ward_bounded"]).to_dict()["options"]["starts"] == []
    told = bc.fit(samples, ["lambert", "lambert + ward_bounded"], starts=asked).to_dict()["options"]["starts"]
    assert [start["lambert.kd"] for start in told] == [[0.1, 0.1, 0.1]]
