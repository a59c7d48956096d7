"""Material as a torch module: state, copies, precision, optimisers, and what its names may not hide."""

import copy
import inspect
import io
import pickle
import re

import numpy as np
import pytest
import torch
from model_cases import CHOICE_IDS, EVERY_CHOICE, draw_values, ends, hemisphere, lobe_pairs, material_of
from torch import nn

import brdfcore as bc
from brdfcore.errors import ParameterError, UnknownNameError

every_choice = pytest.mark.parametrize("choice", EVERY_CHOICE, ids=CHOICE_IDS)
TIED = "coupled_lambert(kd=[0.1, 0.2, 0.3], f0=kurt.f0) + kurt(mx=0.1, my=0.3) + lambert(kd=0.5 - kurt.ks)"


def pairs(count: int = 20) -> tuple[torch.Tensor, torch.Tensor]:
    rng = np.random.default_rng(51)
    return hemisphere(rng, count), hemisphere(rng, count)


# --- copies ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("text", [TIED, "ward(rs=[0.1, 0.2])", "lambert"])
@pytest.mark.parametrize("how", ["state_dict", "deepcopy", "pickle", "torch.save"])
def test_copies_are_equal_and_independent(text, how):
    material = bc.material(text)
    material.f(*pairs())  # with every cached property computed
    if how == "state_dict":
        other = bc.Material(material.form, {key: value.detach() for key, value in material.values().items()})
        with torch.no_grad():
            for parameter in other.parameters():
                parameter.mul_(0.5)
        assert not torch.equal(other.f(*pairs()), material.f(*pairs()))
        other.load_state_dict(material.state_dict())
    elif how == "deepcopy":
        other = copy.deepcopy(material)
    elif how == "pickle":
        other = pickle.loads(pickle.dumps(material))
    else:
        buffer = io.BytesIO()
        torch.save(material.state_dict(), buffer)
        buffer.seek(0)
        other = bc.Material(material.form, {k: v.detach() for k, v in material.values().items()})
        other.load_state_dict(torch.load(buffer, weights_only=True))
    assert other.form == material.form
    assert torch.equal(other.f(*pairs()), material.f(*pairs()))
    assert str(other) == str(material)
    before = material.f(*pairs()).detach().clone()
    with torch.no_grad():
        for parameter in other.parameters():
            parameter.mul_(0.9)
    assert torch.equal(material.f(*pairs()), before)
    assert not torch.equal(other.f(*pairs()), before)


def test_state_dict_holds_stored_values():
    state = bc.material("ward(rs=[0.1, 0.2], a=0.25)").state_dict()
    assert list(state) == ["raw.ward.rs", "raw.ward.a"]
    assert state["raw.ward.rs"].tolist() == [0.1, 0.2]
    assert state["raw.ward.a"].item() == pytest.approx(np.log(0.25), rel=1e-15)
    assert {value.dtype for value in state.values()} == {torch.float64}


def test_a_tied_parameter_is_stored_once():
    material = bc.material(TIED)
    assert "coupled_lambert.f0" not in material.values()
    assert len(list(material.parameters())) == len(material.values())
    assert sorted(f"raw.{key}" for key in material.values()) == sorted(material.state_dict())


# --- precision -------------------------------------------------------------------------------------------------------


def test_single_precision_materials():
    material = bc.material(TIED)
    single = copy.deepcopy(material).to(torch.float32)
    assert {p.dtype for p in single.parameters()} == {torch.float32}
    wi, wo = pairs()
    assert single.f(wi.float(), wo.float()).dtype == torch.float32
    assert single.f(wi, wo).dtype == torch.float64
    assert torch.allclose(single.f(wi, wo), material.f(wi, wo), rtol=1e-5)
    assert str(bc.material(str(single)))  # its values still lie in their boxes
    assert {p.dtype for p in single.double().parameters()} == {torch.float64}


@every_choice
def test_the_ends_of_the_box_stay_in_it_in_single_precision(choice):
    for corner in ends(choice):
        single = material_of(choice, corner).to(torch.float32)
        values = {key: value.detach() for key, value in single.values().items()}
        for key, value in values.items():
            p = single.form.parameters[key]
            assert bool(p.contains(value.double()).all()), (key, value)
            assert float(value) == pytest.approx(corner[p.name], rel=1e-6)
        assert str(bc.material(str(single)))
        assert bc.Material.from_json(single.to_json())


def test_results_do_not_depend_on_a_global_default():
    material = bc.material(TIED)
    wi, wo = pairs()
    expected = material.f(wi.float(), wo.float())
    torch.set_default_dtype(torch.float64)
    try:
        again = bc.material(TIED)
        assert torch.equal(again.f(wi.float(), wo.float()), expected)
        assert again.f(wi.float(), wo.float()).dtype == torch.float32
    finally:
        torch.set_default_dtype(torch.float32)


# --- optimisers ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("optimiser", [torch.optim.Adam, torch.optim.SGD, torch.optim.LBFGS])
def test_torch_optimisers_fit_a_material(optimiser):
    truth = bc.material("lambert(kd=0.2) + ward_bounded(rs=0.3, a=0.2)")
    material = bc.material("lambert(kd=0.1) + ward_bounded(rs=0.1, a=0.35)")
    wi, wo = lobe_pairs(truth, np.random.default_rng(52), 200)
    target = (truth.f(wi, wo) * wi[:, 2:]).detach()
    rate = {torch.optim.Adam: 0.03, torch.optim.SGD: 0.003, torch.optim.LBFGS: 0.5}[optimiser]
    steps = optimiser(material.parameters(), lr=rate)

    def closure():
        steps.zero_grad()
        loss = (material.f(wi, wo) * wi[:, 2:] - target).square().mean()
        loss.backward()
        return loss

    first = closure().item()
    for _ in range(40 if optimiser is not torch.optim.LBFGS else 10):
        steps.step(closure)
        material.project_()
        for key, value in material.values().items():
            assert bool(material.form.parameters[key].contains(value).all())
    assert closure().item() < 0.2 * first


def test_project_puts_every_value_back_into_its_box():
    material = bc.material("lambert(kd=[0.1, 0.5, 0.9]) + kurt")
    with torch.no_grad():
        material.raw["lambert"]["kd"].copy_(torch.tensor([-1.0, 0.5, 2.0]))
        material.raw["kurt"]["alpha"].fill_(-0.1)
        material.raw["kurt"]["m"].fill_(50.0)
        material.raw["kurt"]["f0"].fill_(3.0)
    assert material.project_() is material
    values = {key: value.tolist() for key, value in material.values().items()}
    assert values["lambert.kd"] == [0.0, 0.5, 1.0]
    assert values["kurt.alpha"] == 0
    assert values["kurt.m"] == pytest.approx(10, rel=1e-12)
    assert values["kurt.m"] <= 10
    assert values["kurt.f0"] == 1
    stored = {name: p.detach().clone() for name, p in material.named_parameters()}
    material.project_()
    assert all(torch.equal(p, stored[name]) for name, p in material.named_parameters())
    assert str(bc.material(str(material))) == str(material)


def test_project_respects_ties_to_a_total():
    """kd = 0.175 - rs must stay in its box as well: rs may not pass 0.175."""
    material = bc.material("lambert(kd=0.175 - ward.rs) + ward(rs=0.1)")
    with torch.no_grad():
        material.raw["ward"]["rs"].fill_(0.5)
    material.project_()
    assert material.values()["ward.rs"].item() <= 0.175
    assert str(bc.material(str(material))) == str(material)
    wi, wo = pairs()
    assert bool((material.f(wi, wo) >= 0).all())


def test_values_beyond_the_box_are_evaluated_on_its_end():
    """Between an optimiser's step and project_() the stored value may lie outside; f is never evaluated there."""
    material, end = bc.material("ward(rs=1, a=0.2)"), bc.material("ward(rs=1, a=0.2)")
    with torch.no_grad():
        material.raw["ward"]["rs"].fill_(1.5)
    assert torch.equal(material.f(*pairs()), end.f(*pairs()))


EVEN = ("sigma", "k")  # f goes with their square, so that 0 is a stationary point of the formula itself


@every_choice
def test_gradients_pass_on_the_ends_of_the_box(choice):
    """A start on an end must be able to leave it: no transform may flatten the gradient there."""
    rng = np.random.default_rng(53)
    for corner in ends(choice):
        values = draw_values(choice, rng, where="mild")
        for p in choice.parameters:
            material = material_of(choice, values | {p.name: corner[p.name]})
            inner = material_of(choice, values)
            wi, wo = lobe_pairs(inner if p.scale == "linear" else material, rng, 20)
            stored = material.get_parameter(f"raw.{choice.name}.{p.name}")
            (slope,) = torch.autograd.grad(material.values()[f"{choice.name}.{p.name}"], stored)
            assert slope.abs() > 0, (p.name, corner[p.name])
            f = material.f(wi, wo)
            (gradient,) = torch.autograd.grad(f.sum(), stored)
            stationary = (p.name in EVEN and corner[p.name] == 0) or not f.any()
            assert stationary or gradient.abs() > 0, (p.name, corner[p.name])


# --- making ----------------------------------------------------------------------------------------------------------


def test_values_by_key_may_be_numbers_lists_or_tensors():
    form = bc.material("lambert").form
    for given in ([0.1, 0.2], (0.1, 0.2), torch.tensor([0.1, 0.2], dtype=torch.float64)):
        assert bc.Material(form, {"lambert.kd": given}).values()["lambert.kd"].tolist() == [0.1, 0.2]
    for given in (1.0, torch.tensor(1)):
        assert bc.Material(form, {"lambert.kd": given}).values()["lambert.kd"].item() == 1


def test_a_given_tensor_is_copied():
    given = torch.tensor([0.1, 0.2], dtype=torch.float64)
    material = bc.Material(bc.material("lambert").form, {"lambert.kd": given})
    given.zero_()
    assert material.values()["lambert.kd"].tolist() == [0.1, 0.2]


def test_unknown_and_tied_keys_are_refused():
    form = bc.material("coupled_lambert(f0=kurt.f0) + kurt").form
    with pytest.raises(UnknownNameError, match=r"Expected a parameter to be a known name, got 'kurt\.fo'") as caught:
        bc.Material(form, {"kurt.fo": 0.1})
    assert caught.value.field == "kurt.fo"
    assert "Did you mean 'kurt.f0'?" in str(caught.value)
    with pytest.raises(UnknownNameError, match=re.escape("got 'coupled_lambert.f0'")):
        bc.Material(form, {"coupled_lambert.f0": 0.1})


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -0.1, [0.1, float("nan")]])
def test_values_out_of_the_box_are_refused(value):
    with pytest.raises(ParameterError, match=re.escape("Expected lambert.kd to be in [0, 1], got ")) as caught:
        bc.Material(bc.material("lambert").form, {"lambert.kd": value})
    assert caught.value.field == "lambert.kd"


@pytest.mark.usefixtures("as_shipped")
def test_a_table_of_values_is_refused():
    with pytest.raises(ParameterError, match=r"^Expected lambert\.kd to be one number or one a channel, got "):
        bc.Material(bc.material("lambert").form, {"lambert.kd": [[0.1, 0.2]]})


@pytest.mark.usefixtures("as_shipped")
@pytest.mark.parametrize("value", ["a", None, 1j, {}, [0.1, "b"], [[0.1], [0.1, 0.2]]], ids=str)
def test_what_is_no_number_is_refused(value):
    expected = f"Expected lambert.kd to be one number or one a channel, got {value!r}. Give kd as such."
    with pytest.raises(ParameterError, match=f"^{re.escape(expected)}$") as caught:
        bc.Material(bc.material("lambert").form, {"lambert.kd": value})
    assert caught.value.field == "lambert.kd"


def test_an_empty_list_is_refused():
    with pytest.raises(ParameterError):
        bc.Material(bc.material("lambert").form, {"lambert.kd": []})


# --- names -----------------------------------------------------------------------------------------------------------


def test_no_attribute_shadows_one_of_nn_modules():
    """architecture.md, "Names": half, type, float, compile, parameters, ... keep torch's meaning."""
    module = nn.Module()
    theirs = set(dir(module)) | set(vars(module))
    meant = {
        "__init__",
        "__str__",
        "__doc__",
        "__module__",
        "__annotations__",
        "__annotate__",
        "__annotate_func__",
        "forward",
    }
    assert not {name for name in vars(bc.Material) if name in theirs} - meant
    material = bc.material(TIED)
    material.f(*pairs())
    assert not {name for name in vars(material) if name not in vars(module)} & theirs
    assert set(vars(material)) - set(vars(module)) == {"form"}
    assert set(material._modules) == {"raw"}
    assert inspect.signature(bc.Material.forward).parameters.keys() == {"self", "wi", "wo"}


@pytest.mark.parametrize("label", list(bc.MODELS))
def test_every_model_can_be_a_label_of_the_stored_values(label):
    """torch refuses some names for submodules and parameters (keys, items, type, ...): no model may meet them."""
    material = bc.material(f"{label} + {label}")
    assert {key.split(".")[0] for key in material.values()} == {label, f"{label}_2"}
    wi, wo = pairs()
    assert torch.allclose(material.f(wi, wo), 2 * bc.material(label).f(wi, wo), rtol=1e-12)
