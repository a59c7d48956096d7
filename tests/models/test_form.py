"""A material's structure: what is tied to what, and within which bounds a free value may move."""

import itertools
import re

import pytest
import torch

import brdfcore as bc
from brdfcore.errors import ModelTextError, UnknownNameError
from brdfcore.geometry import geometry
from brdfcore.hard_cases import covering
from brdfcore.models.form import Form, Term, build
from brdfcore.models.text import Tie, parse


def form(text: str) -> Form:
    return bc.material(text).form


def test_forms_compare_and_hash_by_structure():
    assert form("kurt(ks=0.1)") == form("kurt(ks=0.9)")
    assert hash(form("kurt(ks=0.1)")) == hash(form("kurt(ks=0.9)"))
    different = ["kurt", "kurt(constant)", "kurt(anisotropic)", "kurt + kurt", "kurt + kurt(f0=kurt.f0)", "ward"]
    for one, other in itertools.combinations(different, 2):
        assert form(one) != form(other)


def test_a_form_cannot_be_changed():
    with pytest.raises(AttributeError):
        form("kurt").terms = ()
    with pytest.raises(AttributeError):
        form("kurt").terms[0].label = "ward"


def test_keys_follow_the_order_of_the_text():
    one = form("coupled_lambert(f0=kurt.f0) + kurt(mx=0.1)")
    assert list(one.parameters) == ["coupled_lambert.kd", "kurt.ks", "kurt.f0", "kurt.mx", "kurt.my", "kurt.alpha"]
    assert list(one.all_parameters) == [
        "coupled_lambert.kd",
        "coupled_lambert.f0",
        *list(one.parameters)[1:],
    ]
    assert one.ties == {"coupled_lambert.f0": Tie("kurt.f0")}


def test_ties_are_resolved():
    one = form("lambert(kd=[0.3, 0.4] - ward.rs) + ward(a=0.2) + coupled_lambert(f0=ward.rs)")
    values = {"ward.rs": torch.tensor(0.1), "ward.a": torch.tensor(0.2), "coupled_lambert.kd": torch.tensor(0.5)}
    assert one.resolve("lambert.kd", values).tolist() == pytest.approx([0.2, 0.3])
    assert one.resolve("coupled_lambert.f0", values) is values["ward.rs"]
    assert one.resolve("ward.a", values) is values["ward.a"]
    assert one.resolve("lambert.kd", values).dtype == torch.float32
    assert set(one.of_term(one.terms[2], values)) == {"kd", "f0"}


BOUNDS = [
    ("lambert", "lambert.kd", (), 0.0, 1.0),
    ("lambert", "lambert.kd", (3,), [0.0] * 3, [1.0] * 3),
    ("lambert(kd=0.175 - ward.rs) + ward(rs=0.1)", "ward.rs", (), 0.0, 0.175),
    ("lambert(kd=0.175 - ward.rs) + ward(rs=0.1)", "ward.rs", (2,), [0.0] * 2, [0.175] * 2),
    ("lambert(kd=1.2 - ward.rs) + ward(rs=0.5)", "ward.rs", (), 0.2, 1.0),
    ("lambert(kd=[0.2, 0.3] - ward.rs) + ward(rs=0.1)", "ward.rs", (), 0.0, 0.2),
    ("lambert(kd=[0.2, 0.3] - ward.rs) + ward(rs=[0.1, 0.2])", "ward.rs", (2,), [0.0, 0.0], [0.2, 0.3]),
    ("lambert(kd=[1.2, 1.3] - ward.rs) + ward(rs=0.5)", "ward.rs", (), 0.3, 1.0),
    ("lambert(kd=ward.a) + ward(a=0.1)", "ward.a", (), 1e-4, 1.0),
    (
        "lambert(kd=0.5 - ward.rs) + lambert(kd=[0.3, 0.6] - ward.rs) + ward(rs=0.1)",
        "ward.rs",
        (2,),
        [0.0, 0.0],
        [0.3, 0.5],
    ),
]


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize(("text", "key", "shape", "low", "high"), BOUNDS)
def test_bounds_keep_tied_values_in_their_boxes(text, key, shape, low, high, dtype):
    got = form(text).bounds(key, torch.zeros(shape, dtype=dtype))
    for bound, expected in zip(got, (low, high), strict=True):
        assert bound.shape == shape
        assert bound.dtype == dtype
        assert bound.tolist() == pytest.approx(expected, rel=16 * torch.finfo(dtype).eps)


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("lambert(kd=0.3 - ward.rs) + ward(rs=0.1)", "ward.rs"),
        ("lambert(kd=1.7 - ward.rs) + ward(rs=0.8)", "ward.rs"),
        ("lambert(kd=ward.a) + ward(a=0.1)", "ward.a"),
        ("ward(a=0.5 - lambert.kd) + lambert(kd=0.2)", "lambert.kd"),
        ("ward(a=10.5 - lambert.kd) + lambert(kd=0.7)", "lambert.kd"),
        ("kurt(m=1.3 - lambert.kd) + lambert(kd=0.7)", "lambert.kd"),
    ],
)
def test_materials_can_be_made_on_their_bounds_and_are_projected_onto_them(text, key):
    material = bc.material(text)
    for end, beyond in zip(material.form.bounds(key, torch.zeros((), dtype=torch.float64)), (-30.0, 30.0), strict=True):
        values = {name: value.detach() for name, value in material.values().items()} | {key: end}
        bc.Material(material.form, values)
        with torch.no_grad():
            material.get_parameter(f"raw.{key}").fill_(beyond)
        material.project_()
        assert material.values()[key].item() == pytest.approx(end.item(), rel=1e-12, abs=1e-300)
        assert str(bc.material(str(material))) == str(material)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_bounds_of_every_free_parameter_are_its_box(dtype):
    for name in bc.MODELS:
        one = form(name)
        for key, parameter in one.parameters.items():
            low, high = one.bounds(key, torch.zeros((), dtype=dtype))
            assert low.item() == pytest.approx(parameter.low, rel=1e-6 if dtype == torch.float32 else 1e-12)
            assert high.item() == pytest.approx(parameter.high, rel=1e-6 if dtype == torch.float32 else 1e-12)


def test_needs_are_what_the_terms_read():
    """An option that is off costs nothing: a constant lobe computes no h.wo, an isotropic one no p and q."""
    assert form("lambert").needs == set()
    assert not {"p", "q"} & form("ward(isotropic) + kurt(isotropic) + ashikhmin_shirley(isotropic)").needs
    assert {"p", "q"} <= form("ward(anisotropic)").needs
    assert not any("h_dot_wo" in need for need in form("ward_bounded(anisotropic)").needs)
    assert "h_dot_wo" in form("kurt(schlick)").needs
    assert "h_dot_wo" not in form("kurt(constant)").needs
    assert form("lambert + ward").needs == form("ward").needs


@pytest.mark.parametrize("name", list(bc.MODELS))
def test_needs_are_sufficient_and_necessary(name):
    """Nothing is read that is not named (it would be None), and nothing named goes unread."""
    w = torch.tensor([0.6, 0.0, 0.8], dtype=torch.float64)
    for choice in covering(bc.MODELS[name]):
        one = Form((Term(name, choice),))
        values = bc.Material(one).values()
        for evaluate, needs in ((one.f, one.needs), (one.pdf, one.pdf_needs)):
            evaluate(values, geometry(w, w, needs))
            for spared in needs:
                with pytest.raises((TypeError, AttributeError)):
                    evaluate(values, geometry(w, w, needs - {spared}))


def test_shares_follow_the_reflectances():
    one = bc.material("lambert(kd=[0.1, 0.3]) + ward(rs=0.6)")
    assert one.form.shares(one.values()).tolist() == pytest.approx([0.25, 0.75])
    nothing = bc.material("lambert(kd=0) + ward(rs=0) + kurt(ks=0)")
    assert nothing.form.shares(nothing.values()).tolist() == pytest.approx([1 / 3] * 3)


def test_ties_are_checked_when_a_form_is_made():
    lambert, ward = bc.MODELS["lambert"](), bc.MODELS["ward"]()
    with pytest.raises(ModelTextError, match=r"^Expected lambert.kd to be tied to another parameter, got itself\. "):
        Form((Term("lambert", lambert, (("kd", Tie("lambert.kd")),)),))
    with pytest.raises(
        UnknownNameError, match=re.escape("Expected the owner of lambert.kd to be a known name, got 'ward.a2'")
    ):
        Form((Term("lambert", lambert, (("kd", Tie("ward.a2")),)), Term("ward", ward)))


@pytest.mark.parametrize(
    ("text", "prefer", "options", "left_open"),
    [
        ("kurt", (), ("isotropic", "schlick"), ("isotropic", "schlick")),
        ("kurt", ("anisotropic",), ("anisotropic", "schlick"), ("anisotropic", "schlick")),
        ("kurt(isotropic)", ("anisotropic", "constant"), ("isotropic", "constant"), ("constant",)),
        ("kurt(m=0.1)", ("anisotropic",), ("isotropic", "schlick"), ("schlick",)),
        ("kurt(m=0.1, f0=0.1)", ("constant",), ("isotropic", "schlick"), ()),
        ("lambert", ("anisotropic",), (), ()),
    ],
)
def test_what_the_text_leaves_open_is_preferred_or_the_first(text, prefer, options, left_open):
    built, _, opened = build(parse(text), prefer)
    assert built.terms[0].model.options == options
    assert opened == {built.terms[0].label: left_open}


def test_build_returns_the_values_of_the_text():
    _, values, _ = build(parse("lambert(kd=[0.1, 0.2]) + kurt(m=0.3, f0=0.1) + kurt(m=kurt.m)"))
    assert values == {"lambert.kd": (0.1, 0.2), "kurt.m": 0.3, "kurt.f0": 0.1}


def test_equal_choices_are_equal():
    for model in bc.MODELS.values():
        choices = model.with_words(())
        assert len(set(choices)) == len(choices)
        assert choices[0] == model()
        assert model(choices[-1].options) == choices[-1]
        assert model.__name__ in repr(choices[0])
    assert bc.MODELS["ward"]() != bc.MODELS["ward_duer"]()
