"""What a model says of itself: its docstring tells the whole story, and `describe` repeats what it declares."""

import json
import math
import re

import pytest

import brdfcore as bc

every_model = pytest.mark.parametrize("name", list(bc.MODELS))


def boxes_in(text: str) -> set[tuple[str, float, float, str]]:
    """Every (name, low, high, word or "") of a docstring's "Box: a, b in [0, 1]; eta in [1, 4] (dielectric)."."""
    (line,) = re.findall(r"^Box: (.+?)\.$", text, re.MULTILINE | re.DOTALL)
    found = set()
    for part in re.split(r";\s+", line):
        names, low, high, word = re.fullmatch(r"(.+) in \[(\S+), (\S+)\](?:\s+\((\w+)\))?", part).groups()
        ends = [math.pi / 2 if end == "pi/2" else float(end) for end in (low, high)]
        found |= {(name, *ends, word or "") for name in names.split(", ")}
    return found


@every_model
def test_the_docstring_states_each_box(name):
    """A word is named where the same parameter has another box under another."""
    model = bc.MODELS[name]
    facts = model.describe()
    names = [p["name"] for p in facts["parameters"]]
    declared = {
        (p["name"], p["low"], p["high"], p["where"][0] if names.count(p["name"]) > 1 else "")
        for p in facts["parameters"]
    }
    assert boxes_in(facts["text"]) == declared


@every_model
def test_the_docstring_states_the_traits_and_options(name):
    """Beside equation, source and departures (tests/test_layering.py): reciprocity, energy, and every option."""
    model = bc.MODELS[name]
    text = model.describe()["text"]
    assert ("\nReciprocal" in text) == model.reciprocal
    assert ("\nNot reciprocal" in text) == (not model.reciprocal)
    assert "directional albedo" in text
    for group in model.option_groups:
        for word in group:
            assert f"`{word}`" in text, word


@every_model
def test_what_a_model_is_good_for_is_one_short_sentence_of_its_own(name):
    """Its own file says it, in plain words: no formula, no name of the paper."""
    line = vars(bc.MODELS[name])["good_for"]
    assert re.fullmatch(r"[A-Z][a-z0-9 ,:;-]+\.", line)
    assert len(line) <= 90
    assert [other.name for other in bc.MODELS.values() if other.good_for == line] == [name]


@every_model
def test_descriptions_are_what_the_choices_declare(name):
    """`where` names, of each group of options, the words under which a parameter is declared so; none where always."""
    model = bc.MODELS[name]
    facts = json.loads(json.dumps(model.describe()))
    assert facts["name"] == name
    assert facts["summary"].endswith(".")
    assert facts["text"].startswith(facts["summary"])
    assert facts["reciprocal"] is model.reciprocal
    assert facts["options"] == [list(group) for group in model.option_groups]
    for choice in model.choices():
        declared = {
            (p["name"], p["low"], p["high"], p["default"], p["description"], p["scale"], p["per_channel"], p["box"])
            for p in facts["parameters"]
            if all(
                word in p["where"] or not set(group) & set(p["where"])
                for word, group in zip(choice.options, facts["options"], strict=True)
            )
        }
        assert declared == {
            (p.name, p.low, p.high, p.default, p.description, p.scale, p.per_channel, p.box) for p in choice.parameters
        }


def test_an_index_of_refraction_has_a_box_for_each_kind_of_surface():
    boxes = {tuple(p["where"]): p["box"] for p in bc.MODELS["ggx"].describe()["parameters"] if p["name"] == "eta"}
    assert boxes == {("dielectric",): "[1.0001, 4]", ("conductor",): "[0.01, 20]"}


def test_a_parameter_of_several_words_names_them_all():
    where = {p["name"]: p["where"] for p in bc.MODELS["ashikhmin_shirley"].describe()["parameters"]}
    assert where["ks"] == ["scaled", "constant"]
    assert where["f0"] == ["schlick", "scaled"]
    assert where["nu"] == ["anisotropic"]
