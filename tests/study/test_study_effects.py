"""The study of effects: what is left out, the error that it makes, and what the study concludes."""

import pytest
import torch

import brdfcore as bc
from brdfcore.study import STUDIES
from brdfcore.study.effects import EFFECTS, _directions, _error, _sentence, _Simpler, _told_from_none


def test_errors_are_those_of_the_materials_that_remain() -> None:
    whole = _Simpler(frozenset()).made()
    wi, wo = _directions(whole, 400, seed=3)
    assert len(wi) == len(wo) == 400
    assert float(torch.minimum(wi[:, 2], wo[:, 2]).min()) > 0
    assert _error(whole, whole, wi, wo) == 0
    with torch.no_grad():
        gone = bc.material(str(whole).partition(" + ")[2]).f(wi, wo)  # the two lobes, without the diffuse term
        expected = float((gone / whole.f(wi, wo)).square().mean().sqrt())
    assert _error(_Simpler(frozenset({"lobes"})).made(), whole, wi, wo) == pytest.approx(expected, rel=1e-9)
    assert 0.1 < expected < 1, "a term that is left out takes at most all of f away"


def test_every_effect_changes_the_material() -> None:
    whole = str(_Simpler(frozenset()).made())
    made = {effect: str(_Simpler(frozenset({effect})).made()) for effect in EFFECTS}
    assert len({whole, *made.values()}) == len(EFFECTS) + 1
    assert "[" not in made["colour"]
    assert "ax=" not in made["anisotropy"]
    assert "dielectric" not in made["exact Fresnel"] + made["Fresnel"]
    assert "ward_bounded" not in made["second lobe"]
    assert str(_Simpler(frozenset(EFFECTS)).made()).startswith("lambert(kd=0.")


def test_a_small_study() -> None:
    study = STUDIES["effects"](count=256, repeats=1)
    assert study.rows[0][0] == "nothing"
    alone = study.rows[1 : len(EFFECTS) + 1]
    assert {row[0] for row in alone} == set(EFFECTS)
    assert all(row[2] > 0 for row in alone)
    assert [row[2] for row in alone] == sorted(row[2] for row in alone)
    together = study.rows[len(EFFECTS) + 1 :]
    assert len(together) == len(EFFECTS)
    assert together[0][2] == alone[0][2], "the first one alone is the first one of all"
    (chart,) = study.charts
    assert {curve.label for curve in chart.panels[0].curves} == {"one after another", *EFFECTS}


def test_the_sentence_is_computed() -> None:
    errors = {"colour": 0.7, "Fresnel": 0.02, "anisotropy": 0.3}
    text = _sentence(errors, {"colour": 0.1, "Fresnel": 0.2, "anisotropy": 0.0}, 0.01)
    assert text == (
        "Leave out Fresnel first: it saves 20 % of the time for an error of 2 %; keep colour, which changes f by 70 %; "
        "anisotropy costs no time that shows, so keep it too."
    )
    assert _sentence(errors, {"colour": 0.4, "Fresnel": 0.002, "anisotropy": 0.1}, 0.01).startswith(
        "Leave out colour first"
    )
    assert "Fresnel and anisotropy cost no time that shows, so keep them too." in _sentence(
        errors, {"colour": 0.4, "Fresnel": -0.1, "anisotropy": 0.04}, 0.05
    )
    assert _sentence(errors, {"colour": 0.1, "Fresnel": 0.2, "anisotropy": 0.1}, 0.01).endswith("changes f by 70 %.")
    assert _sentence(errors, dict.fromkeys(errors, 0.0), 0.01).startswith("Leave nothing out for speed")


def test_what_the_clock_can_tell_is_measured() -> None:
    """Two standard errors of a saving, from runs whose times differ by 2 % of a standard error each."""
    generator = torch.Generator().manual_seed(1)
    first, second = (
        {str(k): 1 + 0.02 * float(x) for k, x in enumerate(torch.randn(4000, generator=generator))} for _ in range(2)
    )
    assert _told_from_none(first, second) == pytest.approx(2 * 0.02, rel=0.05)
    slowed = {name: 3 * seconds for name, seconds in second.items()}
    assert _told_from_none(first, slowed) < 0.05, "a run that is slower as a whole says nothing of savings"
    assert _told_from_none(first, second | {"7": 9.0}) == pytest.approx(2 * 0.02, rel=0.05), "nor does one busy moment"
    assert _told_from_none(first, first) == 0
