"""The text and JSON forms: they round-trip, and what they cannot hold is refused in one sentence that says why."""

import json
import math
import re

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from model_cases import CHOICE_IDS, EVERY_CHOICE, draw_values, ends, material_of

import brdfcore as bc
from brdfcore.errors import BrdfError, ModelTextError, ParameterError, UnknownNameError
from brdfcore.models.text import Tie, number_text, parse

every_choice = pytest.mark.parametrize("choice", EVERY_CHOICE, ids=CHOICE_IDS)
quickly = settings(max_examples=80, deadline=None, derandomize=True, database=None)


def same_structure(one: bc.Material, other: bc.Material) -> bool:
    return one.form == other.form and list(one.values()) == list(other.values())


# --- round trips -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("channels", [0, 1, 3, 31])
@every_choice
def test_text_round_trips_to_twelve_digits(choice, channels):
    rng = np.random.default_rng(41)
    for where in ("search", "box"):
        material = material_of(choice, draw_values(choice, rng, where=where, channels=channels))
        text = str(material)
        again = bc.material(text)
        assert same_structure(again, material)
        assert str(again) == text
        for key, value in material.values().items():
            assert again.values()[key].shape == value.shape
            assert torch.allclose(again.values()[key], value, rtol=1e-11, atol=0)


@every_choice
def test_text_round_trips_on_the_ends_of_the_box(choice):
    for corner in ends(choice):
        material = material_of(choice, corner)
        assert str(bc.material(str(material))) == str(material)


@pytest.mark.parametrize("channels", [0, 3])
@every_choice
def test_json_round_trips_exactly(choice, channels):
    rng = np.random.default_rng(42)
    drawn = [draw_values(choice, rng, where="box", channels=channels) for _ in range(3)]
    for values in [*drawn, *(ends(choice) if not channels else [])]:
        material = material_of(choice, values)
        again = bc.Material.from_json(json.loads(json.dumps(material.to_json(), allow_nan=False)))
        assert same_structure(again, material)
        for key, value in material.values().items():
            assert torch.equal(again.values()[key], value), (key, value, again.values()[key])


SUMS = [
    "lambert + kurt",
    "coupled_lambert(f0=kurt.f0) + kurt",
    "coupled_lambert(kd=[0.1, 0.2, 0.3], f0=kurt_2.f0) + kurt(m=0.3) + kurt(anisotropic, f0=[0.1, 0.2, 0.3])",
    "ashikhmin_shirley(scaled) + ashikhmin_shirley_diffuse(f0=ashikhmin_shirley.f0)",
    "lambert(kd=0.175 - ward.rs) + ward(rs=0.05)",
    "lambert(kd=[0.2, 0.3, 0.4] - ward_bounded.rs) + ward_bounded(rs=0.05, ax=0.1)",
    "lambert(kd=0.123456789012 - ward.rs) + ward(rs=0.123456789012)",
    "kurt + kurt + kurt",
]


@pytest.mark.parametrize("text", SUMS)
def test_sums_and_ties_round_trip(text):
    material = bc.material(text)
    again = bc.material(str(material))
    assert str(again) == str(material)
    assert same_structure(again, material)
    exact = bc.Material.from_json(json.loads(json.dumps(material.to_json())))
    assert same_structure(exact, material)
    assert all(torch.equal(exact.values()[key], value) for key, value in material.values().items())
    wi, wo = (torch.tensor(w, dtype=torch.float64) for w in ([0.0, 0.6, 0.8], [0.6, 0.0, 0.8]))
    assert torch.equal(exact.f(wi, wo), material.f(wi, wo))


def test_json_keeps_totals_that_text_rounds():
    total = 0.1 + 0.2  # 0.30000000000000004
    material = bc.material(f"lambert(kd={total!r} - ward.rs) + ward(rs=0.1)")
    again = bc.Material.from_json(json.loads(json.dumps(material.to_json())))
    assert again.form.ties["lambert.kd"].total == (total,)
    assert "kd=0.3 - ward.rs" in str(material)


def test_json_holds_natural_values():
    data = bc.material("ward(rs=0.05, a=0.25)").to_json()
    assert data == {
        "terms": [{"label": "ward", "model": "ward", "options": ["isotropic"], "ties": {}}],
        "values": {"ward.rs": 0.05, "ward.a": pytest.approx(0.25, rel=1e-15)},
    }


@quickly
@given(
    st.floats(0, 1, exclude_min=True),
    st.floats(1e-4, 10),
    st.lists(st.floats(0, 1), min_size=1, max_size=5),
    st.floats(0, 1),
)
def test_any_value_in_its_box_round_trips(rs, a, kd, alpha):
    text = f"lambert(kd={kd!r}) + ward(rs={rs!r}, a={a!r}) + kurt(alpha={alpha!r})"
    material = bc.material(text)
    assert str(bc.material(str(material))) == str(material)
    values = {key: value.tolist() for key, value in material.values().items()}
    assert values["lambert.kd"] == kd
    assert values["ward.rs"] == rs
    assert values["ward.a"] == pytest.approx(a, rel=2e-15)
    again = bc.Material.from_json(json.loads(json.dumps(material.to_json())))
    assert {key: value.tolist() for key, value in again.values().items()} == values


# --- reading ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "labels"),
    [
        ("kurt", ["kurt"]),
        ("kurt + kurt", ["kurt", "kurt_2"]),
        ("kurt + lambert + kurt + kurt", ["kurt", "lambert", "kurt_2", "kurt_3"]),
        ("lambert + kurt + lambert", ["lambert", "kurt", "lambert_2"]),
    ],
)
def test_repeated_models_are_numbered(text, labels):
    material = bc.material(text)
    assert [term.label for term in material.form.terms] == labels
    assert {key.split(".")[0] for key in material.values()} == set(labels)


def test_appending_a_term_renames_none():
    short, long = bc.material("kurt + lambert"), bc.material("kurt + lambert + kurt")
    assert list(long.values())[: len(short.values())] == list(short.values())


@pytest.mark.parametrize(
    ("text", "options"),
    [
        ("kurt", ("isotropic", "schlick")),
        ("kurt()", ("isotropic", "schlick")),
        ("kurt(m=0.2)", ("isotropic", "schlick")),
        ("kurt(mx=0.2)", ("anisotropic", "schlick")),
        ("kurt(anisotropic)", ("anisotropic", "schlick")),
        ("kurt(constant, my=0.2)", ("anisotropic", "constant")),
        ("kurt(my=0.2, constant)", ("anisotropic", "constant")),
        ("ashikhmin_shirley", ("isotropic", "schlick")),
        ("ashikhmin_shirley(ks=0.5)", ("isotropic", "scaled")),
        ("ashikhmin_shirley(ks=0.5, f0=0.1)", ("isotropic", "scaled")),
        ("ashikhmin_shirley(nv=20, constant)", ("anisotropic", "constant")),
        ("lambert", ()),
    ],
)
def test_words_and_names_choose_the_options(text, options):
    assert bc.material(text).form.terms[0].model.options == options


@pytest.mark.parametrize(
    "text",
    [
        " lambert ( kd = 0.2 ) ",
        "lambert(kd=.2)",
        "lambert(kd=2e-1)",
        "lambert(kd=+0.2)",
        "lambert(kd=0.20)",
        "lambert(\n    kd=2.E-1,\n)".replace(",\n)", ")"),
        "\tlambert(kd=0.2)\n",
    ],
)
def test_white_space_and_number_formats(text):
    assert str(bc.material(text)) == "lambert(kd=0.2)"


@pytest.mark.parametrize("text", ["lambert(kd=0.175-ward.rs)+ward", "lambert( kd = 0.175 - ward . rs ) + ward"])
def test_a_total_tie_needs_no_spaces(text):
    assert bc.material(text).form.ties == {"lambert.kd": Tie("ward.rs", (0.175,))}


def test_a_list_of_one_is_one_channel():
    material = bc.material("lambert(kd=[0.2])")
    assert material.values()["lambert.kd"].shape == (1,)
    assert material.channels == 1
    assert str(material) == "lambert(kd=[0.2])"


def test_defaults_are_printed():
    assert str(bc.material("kurt")) == "kurt(isotropic, schlick, ks=0.5, f0=0.04, m=0.1, alpha=0.1)"


def test_a_form_without_values_has_a_text():
    form = bc.material("coupled_lambert(f0=kurt.f0) + kurt(mx=0.2)").form
    assert form.text() == "coupled_lambert(f0=kurt.f0) + kurt(anisotropic, schlick)"
    assert bc.material(form.text()).form == form


def test_number_text_prints_twelve_digits():
    assert number_text(1 / 3) == "0.333333333333"
    assert number_text((0.1, 1e-5)) == "[0.1, 1e-05]"
    assert number_text(math.inf) == "inf"


# --- refusing --------------------------------------------------------------------------------------------------------

KNOWN_MODELS = ", ".join(bc.MODELS)
HINT = "Write it like 'lambert(kd=0.2) + ward_bounded(isotropic, rs=0.05, a=0.03)'."

# ruff: noqa: E501  -- a row a text, with its sentence: the table is easier to read, and to search, unwrapped
REFUSED = [
    # unknown names, with the nearest
    ("ward_bouned", UnknownNameError, "model", "Expected a model or preset to be a known name, got 'ward_bouned'. Did you mean 'ward_bounded'? "),
    ("wxyz", UnknownNameError, "model", f"Expected a model or preset to be a known name, got 'wxyz'. Known: {KNOWN_MODELS}, {', '.join(bc.PRESETS)}."),
    ("wxyz(a=1)", UnknownNameError, "model", f"Expected a model to be a known name, got 'wxyz'. Known: {KNOWN_MODELS}."),
    ("brushed_aluminum_kurt", UnknownNameError, "model", "Did you mean 'brushed_aluminium_kurt'? "),
    # presets, which are no terms
    ("walter_figure_3 + lambert", ModelTextError, "model", "Expected the preset walter_figure_3 to stand alone, got 'walter_figure_3 + lambert'. Write its text instead: 'ward(isotropic, rs=0.75, a=0.15)'."),
    ("lambert + kurt_eq_11", ModelTextError, "model", "Expected the preset kurt_eq_11 to stand alone, got 'lambert + kurt_eq_11'. Write its text instead: 'lambert + kurt'."),
    ("kurt_eq_11(anisotropic)", ModelTextError, "model", "Expected the preset kurt_eq_11 to stand alone, got 'kurt_eq_11(anisotropic)'."),
    ("kurt_eq_11(f0=0.1)", ModelTextError, "model", "Expected the preset kurt_eq_11 to stand alone, got 'kurt_eq_11(f0=0.1)'."),
    ("lambert + kurtt", UnknownNameError, "model", "got 'kurtt'. Did you mean 'kurt'? "),
    ("ward(anisotrpic)", UnknownNameError, "model", "Expected an option of ward to be a known name, got 'anisotrpic'. Did you mean 'anisotropic'? Known: isotropic, anisotropic."),
    ("ward(m=0.1)", UnknownNameError, "model", "Expected a parameter of ward to be a known name, got 'm'. Known: rs, a, ax, ay."),
    ("kurt(alfa=0.1)", UnknownNameError, "model", "got 'alfa'. Did you mean 'alpha'? "),
    ("ward(constant)", UnknownNameError, "model", "Expected an option of ward to be a known name, got 'constant'."),
    # contradictions and repeats
    ("kurt(isotropic, anisotropic)", ModelTextError, "model", "Expected one of isotropic, anisotropic for kurt, got isotropic and anisotropic. Keep one."),
    ("kurt(isotropic, mx=0.1)", ModelTextError, "model", "Expected the options and parameters of kurt to agree, got isotropic, mx. Drop one of them: mx belongs to anisotropic."),
    ("kurt(m=0.1, my=0.2)", ModelTextError, "model", "Expected the options and parameters of kurt to agree, got m, my. Drop one of them: m belongs to isotropic; my belongs to anisotropic."),
    ("kurt(constant, f0=0.1)", ModelTextError, "model", "got constant, f0. Drop one of them: f0 belongs to schlick."),
    ("ashikhmin_shirley(schlick, ks=0.5)", ModelTextError, "model", "got schlick, ks. Drop one of them: ks belongs to scaled or constant."),
    ("ggx(ks=0.1, eta=1.5, f0=1)", ModelTextError, "model", "got ks, eta, f0. Drop one of them: eta belongs to dielectric or conductor; f0 belongs to schlick."),
    ("ggx(compensated, ax=0.1)", ModelTextError, "model", "got compensated, ax. Drop one of them: ax belongs to anisotropic."),
    ("kurt(m=0.1, m=0.2)", ModelTextError, "model", "Expected each argument of kurt once, got m twice. Keep one."),
    ("kurt(isotropic, isotropic)", ModelTextError, "model", "Expected each argument of kurt once, got isotropic twice. Keep one."),
    # ties
    ("kurt(f0=kurt.f0)", ModelTextError, "kurt.f0", "Expected kurt.f0 to be tied to another parameter, got itself. Name the owner."),
    ("kurt(f0=kurt_2.f0) + kurt(f0=kurt_3.f0) + kurt", ModelTextError, "kurt.f0", "Expected kurt.f0 to be tied to a free parameter, got kurt_2.f0, which is tied itself. Tie kurt.f0 to kurt_3.f0."),
    ("lambert(kd=ward.rs) + ward(rs=lambert.kd)", ModelTextError, "lambert.kd", "Expected lambert.kd to be tied to a free parameter, got ward.rs, which is tied itself."),
    ("coupled_lambert(f0=kurt.f0)", UnknownNameError, "model", "Expected the owner of coupled_lambert.f0 to be a known name, got 'kurt.f0'."),
    ("coupled_lambert(f0=kurt.f0) + kurt(constant)", UnknownNameError, "model", "Expected the owner of coupled_lambert.f0 to be a known name, got 'kurt.f0'."),
    ("coupled_lambert(f0=kurt.fO) + kurt", UnknownNameError, "model", "got 'kurt.fO'. Did you mean 'kurt.f0'? "),
    ("lambert(kd=0.1 - ward.rs) + ward(rs=0.2)", ParameterError, "lambert.kd", "Expected lambert.kd to be in [0, 1], got -0.1 from its tie to ward.rs. Change the owner's value or the total."),
    ("lambert(kd=[0.3, 0.1] - ward.rs) + ward(rs=0.2)", ParameterError, "lambert.kd", "Expected lambert.kd to be in [0, 1], got -0.1 from its tie"),
    ("lambert(kd=1.5 - ward.rs) + ward(rs=0.2)", ParameterError, "lambert.kd", "Expected lambert.kd to be in [0, 1], got 1.3 from its tie"),
    ("ward(a=lambert.kd) + lambert(kd=0)", ParameterError, "ward.a", "Expected ward.a to be in [0.0001, 10], got 0 from its tie to lambert.kd."),
    # values
    ("lambert(kd=1.5)", ParameterError, "lambert.kd", "Expected lambert.kd to be in [0, 1], got 1.5. It is the diffuse reflectance [1]; choose a value in that range."),
    ("lambert(kd=-0.1)", ParameterError, "lambert.kd", "Expected lambert.kd to be in [0, 1], got -0.1."),
    ("lambert(kd=1e999)", ParameterError, "lambert.kd", "Expected lambert.kd to be in [0, 1], got inf."),
    ("lambert(kd=[0.1, 2, 0.3])", ParameterError, "lambert.kd", "Expected lambert.kd to be in [0, 1], got 2."),
    ("ward(a=0)", ParameterError, "ward.a", "Expected ward.a to be in [0.0001, 10], got 0."),
    ("kurt + kurt(alpha=1.01)", ParameterError, "kurt_2.alpha", "Expected kurt_2.alpha to be in [0, 1], got 1.01."),
    ("ward(a=[0.1, 0.2, 0.3])", ParameterError, "ward.a", "Expected ward.a to be one number, got [0.1, 0.2, 0.3]. Give a as such."),
    ("kurt(alpha=[0.1])", ParameterError, "kurt.alpha", "Expected kurt.alpha to be one number, got [0.1]."),
    ("lambert(kd=[0.1, 0.2]) + ward(rs=[0.1, 0.2, 0.3])", ParameterError, "lambert.kd", "Expected lambert.kd to have 3 channels as the material's other parameters have, got 2. Give it one number, or one a channel."),
    ("lambert(kd=[0.2, 0.3] - ward.rs) + ward(rs=[0.1, 0.1, 0.1])", ParameterError, "lambert.kd", "Expected lambert.kd to have 3 channels as the material's other parameters have, got 2."),
    # a tie that would give a shape a value a channel
    ("ward(a=lambert.kd) + lambert(kd=[0.1, 0.2, 0.3])", ParameterError, "ward.a", "Expected ward.a to be one number"),
    ("ward(a=[0.5, 0.6] - lambert.kd) + lambert(kd=0.1)", ParameterError, "ward.a", "Expected ward.a to be one number"),
    # broken text
    ("", ModelTextError, "model", f"Expected a model's name in the model '', got the end of the text. {HINT}"),
    ("   ", ModelTextError, "model", "Expected a model's name in the model '   ', got the end of the text."),
    ("lambert(", ModelTextError, "model", "Expected an option or a parameter in the model 'lambert(', got the end of the text."),
    ("lambert(kd", ModelTextError, "model", "Expected ',' or ')' in the model 'lambert(kd', got the end of the text."),
    ("lambert(kd=", ModelTextError, "model", "Expected a value, or another term's parameter such as kurt.f0 in the model 'lambert(kd=', got the end of the text."),
    ("lambert(kd=0.2", ModelTextError, "model", "Expected ',' or ')' in the model 'lambert(kd=0.2', got the end of the text."),
    ("lambert(kd=[", ModelTextError, "model", "Expected a number in the model 'lambert(kd=[', got the end of the text."),
    ("lambert(kd=[]", ModelTextError, "model", "Expected a number in the model 'lambert(kd=[]', got ']' at character 13."),
    ("lambert(kd=[0.1 0.2])", ModelTextError, "model", "Expected ',' or ']' in the model"),
    ("lambert(kd=[0.1,])", ModelTextError, "model", "Expected a number in the model"),
    ("lambert(kd=ward)", ModelTextError, "model", "Expected '.' after ward in the model"),
    ("lambert(kd=ward.)", ModelTextError, "model", "Expected a parameter of ward in the model"),
    ("lambert(kd=0.2 - )", ModelTextError, "model", "Expected a value, or another term's parameter such as kurt.f0 in the model"),
    ("lambert(kd=0.2 - 0.1)", ModelTextError, "model", "in the model 'lambert(kd=0.2 - 0.1)', got "),
    ("lambert +", ModelTextError, "model", "Expected a model's name in the model 'lambert +', got the end of the text."),
    ("+ lambert", ModelTextError, "model", "Expected a model's name in the model '+ lambert', got '+ lambert' at character 1."),
    ("lambert lambert", ModelTextError, "model", "Expected '+' or the end in the model 'lambert lambert', got 'lambert' at character 9."),
    ("lambert(kd=0.2))", ModelTextError, "model", "Expected '+' or the end in the model 'lambert(kd=0.2))', got ')' at character 16."),
    ("lambert(kd=0.2;)", ModelTextError, "model", "Expected ',' or ')' in the model"),
    ("lambert(kd=0.2,)", ModelTextError, "model", "Expected an option or a parameter in the model"),
    ("lambert(,kd=0.2)", ModelTextError, "model", "Expected an option or a parameter in the model"),
    ("lambert(kd==0.2)", ModelTextError, "model", "Expected a value, or another term's parameter such as kurt.f0 in the model"),
    ("lambert(kd=nan)", ModelTextError, "model", "Expected '.' after nan in the model"),
    ("lambert(kd=0.1.2)", ModelTextError, "model", "Expected ',' or ')' in the model"),
    ("lambert(0.2)", ModelTextError, "model", "Expected an option or a parameter in the model 'lambert(0.2)', got '0.2)' at character 9."),
    ("lambert # comment", ModelTextError, "model", "Expected '+' or the end in the model"),
    ("lambért", UnknownNameError, "model", "Did you mean 'lambert'?"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "kind", "field", "message"), REFUSED, ids=[case[0] for case in REFUSED])
def test_a_wrong_text_is_refused_in_one_sentence(text, kind, field, message):
    with pytest.raises(kind, match=re.escape(message)) as caught:
        bc.material(text)
    assert caught.value.field == field
    assert "\n" not in str(caught.value).replace(repr(text), "")


@pytest.mark.usefixtures("as_shipped")
@pytest.mark.parametrize(
    "given", [None, 3, b"kurt", bc.MODELS["kurt"], bc.material("kurt")], ids=lambda x: type(x).__name__
)
def test_what_is_no_text_is_refused_in_one_sentence(given):
    expected = f"Expected the model to be a text, got {type(given).__name__}. {HINT}"
    with pytest.raises(ModelTextError, match=f"^{re.escape(expected)}$") as caught:
        bc.material(given)
    assert caught.value.field == "model"


def test_the_message_of_a_cycle_does_not_advise_a_self_tie():
    with pytest.raises(ModelTextError) as caught:
        bc.material("lambert(kd=ward.rs) + ward(rs=lambert.kd)")
    assert "Tie lambert.kd to lambert.kd" not in str(caught.value)


def test_an_option_where_there_are_none_says_so():
    with pytest.raises(
        UnknownNameError, match=r"^Expected an option of lambert to be a known name, got 'isotropic'\. "
    ) as caught:
        bc.material("lambert(isotropic)")
    assert not str(caught.value).endswith("Known: .")


MARKS = "lambertkurdw_2(),=[]+-. 0123456789e\n"
VALID = [*SUMS, "kurt(mx=0.1, my=0.3, alpha=0.2)", "lambert(kd=[0.1, 0.2, 0.3])"]


def reads_or_refuses(text: str) -> bool:
    """Whether the text is a material that reads back, or raises a whole sentence that names a field."""
    try:
        material = bc.material(text)
    except BrdfError as error:
        return str(error).endswith(("?", ".")) and error.field is not None
    return str(bc.material(str(material))) == str(material)


@quickly
@given(st.text(alphabet=MARKS, max_size=40) | st.text(max_size=20))
def test_any_text_is_a_material_or_a_brdf_error(text):
    assert reads_or_refuses(text)


@settings(quickly, max_examples=400)
@given(st.sampled_from(VALID), st.data())
def test_any_damaged_text_is_a_material_or_a_brdf_error(text, data):
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(text)))
        length = data.draw(st.integers(0, 4))
        text = text[:at] + data.draw(st.text(alphabet=MARKS, max_size=3)) + text[at + length :]
    assert reads_or_refuses(text)


@quickly
@given(
    st.lists(
        st.sampled_from(["lambert", "kurt", "ward", "(", ")", ",", "=", "[", "]", "0.1", "-", "+", ".", "kd", "f0"]),
        max_size=14,
    )
)
def test_any_row_of_tokens_is_a_material_or_a_brdf_error(tokens):
    assert reads_or_refuses("".join(tokens))


def test_parsing_long_text_takes_linear_time():
    terms = parse(" + ".join(["kurt(ks=[0.1, 0.2, 0.3])"] * 3000))
    assert len(terms) == 3000
    with pytest.raises(BrdfError):
        parse("lambert(kd=" + "[" * 100_000)


# --- JSON that is none -----------------------------------------------------------------------------------------------

GOOD = bc.material("lambert(kd=0.175 - ward.rs) + ward(rs=0.1)").to_json()


def _changed(path: tuple, value: object) -> object:
    data = json.loads(json.dumps(GOOD))
    place = data
    for step in path[:-1]:
        place = place[step]
    place[path[-1]] = value
    return data


BAD_JSON = [
    None,
    3,
    "lambert",
    [],
    {},
    {"terms": GOOD["terms"]},
    {"values": {}},
    _changed(("terms",), None),
    _changed(("terms",), 3),
    _changed(("terms",), ["lambert"]),
    _changed(("terms",), {"label": "lambert"}),
    _changed(("terms",), []),
    _changed(("terms", 0, "model"), "lambrt"),
    _changed(("terms", 0, "model"), 3),
    _changed(("terms", 0, "model"), ["lambert"]),
    _changed(("terms", 0, "label"), 3),
    _changed(("terms", 0, "label"), "a.b"),
    _changed(("terms", 0, "label"), ""),
    _changed(("terms", 0, "label"), "ward"),
    _changed(("terms", 1, "options"), ["anisotropc"]),
    _changed(("terms", 1, "options"), 3),
    _changed(("terms", 1, "options"), None),
    _changed(("terms", 0, "ties"), None),
    _changed(("terms", 0, "ties"), {"kd": None}),
    _changed(("terms", 0, "ties"), {"nothing": {"owner": "ward.rs", "total": None}}),
    _changed(("terms", 0, "ties"), {"kd": {"owner": "ward.nothing", "total": None}}),
    _changed(("terms", 0, "ties"), {"kd": {"owner": 3, "total": None}}),
    _changed(("terms", 0, "ties"), {"kd": {"owner": "ward.rs", "total": "abc"}}),
    _changed(("terms", 0, "ties"), {"kd": {"owner": "ward.rs", "total": [None]}}),
    _changed(("terms", 0, "ties"), {"kd": {"owner": "ward.rs", "total": []}}),
    _changed(("terms", 0, "ties"), {"kd": {"owner": "ward.rs", "total": 0.3}}),
    _changed(("values",), None),
    _changed(("values",), []),
    _changed(("values",), {"ward.rs": "abc"}),
    _changed(("values",), {"ward.rs": None}),
    _changed(("values",), {"ward.rs": []}),
    _changed(("values",), {"ward.rs": [[0.1]]}),
    _changed(("values",), {"ward.rs": [0.1, None]}),
    _changed(("values",), {"ward.rs": {"x": 1}}),
    _changed(("values",), {"ward.rs": 2}),
    _changed(("values",), {"ward.rs": float("nan")}),
    _changed(("values",), {"ward.nothing": 1}),
    _changed(("values",), {"ward.rs": True, "ward.a": -1}),
]


def test_the_good_json_is_good():
    assert str(bc.Material.from_json(GOOD)) == str(bc.material("lambert(kd=0.175 - ward.rs) + ward(rs=0.1)"))


@pytest.mark.usefixtures("as_shipped")
@pytest.mark.parametrize("data", BAD_JSON, ids=lambda data: json.dumps(data)[:120])
def test_json_that_is_no_material_is_refused(data):
    with pytest.raises(BrdfError) as caught:
        bc.Material.from_json(data)
    assert caught.value.field


def test_the_message_of_json_without_values():
    expected = (
        "Expected a material's JSON with terms and values, got something without 'values'. "
        "Pass what Material.to_json returned."
    )
    with pytest.raises(ModelTextError, match=f"^{re.escape(expected)}$"):
        bc.Material.from_json({"terms": []})


@pytest.mark.usefixtures("as_shipped")
def test_json_of_an_unknown_model_names_the_nearest():
    with pytest.raises(UnknownNameError, match=r"got 'lambrt'\. Did you mean 'lambert'\?"):
        bc.Material.from_json(_changed(("terms", 0, "model"), "lambrt"))


@pytest.mark.parametrize("text", [None, 3, b"lambert", ["lambert"]], ids=repr)
def test_what_is_no_text_is_refused(text):
    with pytest.raises((BrdfError, TypeError)):
        bc.material(text)
