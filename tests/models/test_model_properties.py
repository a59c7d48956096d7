"""What every model promises in every choice of options: reciprocity, shapes, dtypes, channels, derivatives."""

import re

import numpy as np
import pytest
import torch
from model_cases import (
    CHOICE_IDS,
    CHOICES,
    COVERING,
    DTYPES,
    EPS,
    EVERY_CHOICE,
    SAME,
    draw_value,
    draw_values,
    form_of,
    hemisphere,
    lobe_pairs,
    material_of,
    name_of,
)
from torch.func import functional_call

import brdfcore as bc
from brdfcore.errors import InvalidValueError
from brdfcore.geometry import geometry

every_choice = pytest.mark.parametrize("choice", EVERY_CHOICE, ids=CHOICE_IDS)
every_dtype = pytest.mark.parametrize("dtype", DTYPES, ids=["float32", "float64"])


def close(got: torch.Tensor, expected: torch.Tensor, factor: float = SAME) -> bool:
    """Equal but for `factor` roundings, relative to each number."""
    assert got.dtype == expected.dtype
    assert got.shape == expected.shape
    return bool(((got - expected).abs() <= factor * EPS[got.dtype] * expected.abs()).all())


@every_dtype
@every_choice
def test_reciprocal_and_not_negative(choice, dtype):
    rng = np.random.default_rng(11)
    for where in ("search", "box"):
        material = material_of(choice, draw_values(choice, rng, where=where, channels=3))
        wi, wo = lobe_pairs(material, rng, 200, dtype)
        wi, wo = (torch.cat([x, hemisphere(rng, 200, dtype)]) for x in (wi, wo))
        f = material.f(wi, wo)
        assert bool((f >= 0).all())
        assert bool((material.pdf(wi, wo) >= 0).all())
        assert float(f.detach().max()) > 0
        reciprocal = close(f, material.f(wo, wi), factor=2)
        assert reciprocal == choice.reciprocal, "a model that is not reciprocal says so, and one that is is"


@every_choice
def test_gradcheck_of_stored_values(choice):
    rng = np.random.default_rng(12)
    material = material_of(choice, draw_values(choice, rng, where="mild", channels=2))
    wi, wo = lobe_pairs(material, rng, 3)
    names = [name for name, _ in material.named_parameters()]

    def f(*stored):
        return functional_call(material, dict(zip(names, stored, strict=True)), (wi, wo))

    stored = [p.detach().clone().requires_grad_() for p in material.parameters()]
    assert torch.autograd.gradcheck(f, stored, rtol=1e-5, atol=1e-7)


@every_choice
def test_gradcheck_of_directions_natural_values_and_density(choice):
    rng = np.random.default_rng(13)
    material = material_of(choice, draw_values(choice, rng, where="mild", channels=2))
    wi, wo = lobe_pairs(material, rng, 2)
    form, values = form_of(choice), material.values()

    def f(wi, wo, *natural):
        return form.f(dict(zip(values, natural, strict=True)), geometry(wi, wo, form.needs))

    def pdf(wi, wo, *natural):
        return form.pdf(dict(zip(values, natural, strict=True)), geometry(wi, wo, form.pdf_needs))

    natural = [v.detach().clone().requires_grad_() for v in values.values()]
    for function in (f, pdf):
        inputs = (wi.requires_grad_(), wo.requires_grad_(), *natural)
        assert torch.autograd.gradcheck(function, inputs, rtol=1e-5, atol=1e-7)


@every_choice
def test_gradcheck_of_samples(choice):
    """Differentiable rendering moves the samples themselves."""
    rng = np.random.default_rng(10)
    material = material_of(choice, draw_values(choice, rng, where="mild"))
    form, values = form_of(choice), material.values()
    wo, u = hemisphere(rng, 4), torch.tensor(rng.uniform(0, 1, (4, 3)))

    def sample(wo, *natural):
        return form.sample(dict(zip(values, natural, strict=True)), wo, u) + 0 * wo  # some depend on nothing

    natural = [v.detach().clone().requires_grad_() for v in values.values()]
    assert torch.autograd.gradcheck(sample, (wo.requires_grad_(), *natural), rtol=1e-5, atol=1e-7)


@every_choice
def test_second_derivatives_exist(choice):
    """Newton-type users differentiate twice; no in-place step or detached piece may stand in the way."""
    rng = np.random.default_rng(14)
    material = material_of(choice, draw_values(choice, rng, where="mild"))
    wi, wo = lobe_pairs(material, rng, 5)
    parameters = list(material.parameters())
    first = torch.autograd.grad(material.f(wi, wo).sum(), parameters, create_graph=True)
    total = sum((g.square().sum() for g in first if g.requires_grad), torch.zeros((), dtype=torch.float64))
    if total.requires_grad:
        second = torch.autograd.grad(total, parameters, allow_unused=True)
        assert all(g is None or g.isfinite().all() for g in second)


@pytest.mark.parametrize(("channels", "dtype"), [(0, torch.float32), (3, torch.float64)], ids=["gray-32", "rgb-64"])
@every_choice
def test_directions_broadcast(choice, channels, dtype):
    rng = np.random.default_rng(15)
    material = material_of(choice, draw_values(choice, rng, where="mild", channels=channels))
    wi, wo = hemisphere(rng, 3, dtype), hemisphere(rng, 4, dtype)
    count = material.channels
    assert count == (channels or 1)
    grid = material.f(wi[:, None], wo)
    assert grid.shape == (3, 4, count)
    assert material.weight(wi[:, None], wo).shape == (3, 4, count)
    density = material.pdf(wi[:, None], wo)
    assert density.shape == (3, 4)
    for i in range(3):
        assert close(grid[i], material.f(wi[i], wo))
        assert close(density[i], material.pdf(wi[i], wo))
    assert material.f(wi[0], wo[0]).shape == (count,)
    assert material.pdf(wi[0], wo[0]).shape == ()
    assert close(material.f(wi[0], wo[0]), grid[0, 0])
    assert material.f(wi[:0], wo[:1]).shape == (0, count)
    assert material.pdf(wi[:0], wo[:1]).shape == (0,)
    u = torch.tensor(rng.uniform(0, 1, (2, 4, 3))).to(dtype)
    assert material.sample(wo, u).shape == (2, 4, 3)
    assert material.sample(wo[0], u[0, 0]).shape == (3,)
    assert material.sample(wo[0], u).shape == (2, 4, 3)
    assert bool((material.sample(wo, u) == torch.stack([material.sample(wo, row) for row in u])).all())


@every_dtype
@every_choice
def test_results_keep_the_dtype_of_the_directions(choice, dtype):
    rng = np.random.default_rng(16)
    material = material_of(choice, draw_values(choice, rng, where="mild", channels=3))
    wi, wo = lobe_pairs(material, rng, 10, dtype)
    u = torch.tensor(rng.uniform(0, 1, (10, 3)), dtype=dtype)
    results = [material.f(wi, wo), material(wi, wo), material.pdf(wi, wo), material.weight(wi, wo)]
    assert {r.dtype for r in [*results, material.sample(wo, u)]} == {dtype}
    single = material_of(choice, draw_values(choice, rng, where="mild")).to(torch.float32)
    assert single.f(wi, wo).dtype == dtype


@every_choice
def test_mixed_precisions_are_promoted(choice):
    rng = np.random.default_rng(17)
    material = material_of(choice, draw_values(choice, rng, where="mild"))
    wi, wo = lobe_pairs(material, rng, 10, torch.float32)
    expected = material.f(wi.double(), wo.double())
    assert torch.equal(material.f(wi.double(), wo), expected)
    assert torch.equal(material.f(wi, wo.double()), expected)
    assert torch.equal(material.pdf(wi, wo.double()), material.pdf(wi.double(), wo.double()))
    assert torch.equal(material.weight(wi, wo.double()), material.weight(wi.double(), wo.double()))


@pytest.mark.usefixtures("as_shipped")
@pytest.mark.parametrize("dtype", [torch.float16, torch.bfloat16, torch.int64, torch.bool, torch.complex64], ids=str)
@pytest.mark.parametrize("method", ["f", "pdf", "weight", "__call__"])
def test_other_dtypes_are_refused_in_one_sentence(method, dtype):
    material = bc.material("lambert + kurt")
    good, bad = torch.tensor([[0.0, 0.0, 1.0]]), torch.tensor([[0, 0, 1]]).to(dtype)
    for arguments, name in (((bad, good), "wi"), ((good, bad), "wo")):
        expected = f"Expected {name} to be float32 or float64, got {dtype}. Convert it with {name}.float()."
        with pytest.raises(InvalidValueError, match=f"^{re.escape(expected)}$") as caught:
            getattr(material, method)(*arguments)
        assert caught.value.field == name


@pytest.mark.usefixtures("as_shipped")
@pytest.mark.parametrize("dtype", [torch.float16, torch.bfloat16, torch.int64, torch.bool], ids=str)
def test_sample_refuses_other_dtypes(dtype):
    material = bc.material("lambert + kurt")
    wo = torch.tensor([[0, 0, 1]]).to(dtype)
    with pytest.raises(InvalidValueError, match=r"^Expected wo to be float32 or float64, got") as caught:
        material.sample(wo, torch.full((1, 3), 0.5))
    assert caught.value.field == "wo"


@pytest.mark.usefixtures("as_shipped")
@pytest.mark.parametrize("shape", [(3, 2), (4,), (), (2, 0)], ids=str)
@pytest.mark.parametrize("method", ["f", "pdf", "weight"])
def test_directions_of_a_wrong_shape_are_refused(method, shape):
    material = bc.material("lambert + kurt")
    good, bad = torch.tensor([[0.0, 0.0, 1.0]]), torch.zeros(shape)
    for arguments, name in (((bad, good), "wi"), ((good, bad), "wo")):
        expected = (
            f"Expected {name} to be unit vectors on a last axis of length 3, got shape {tuple(shape)}. "
            "Pass directions as (..., 3)."
        )
        with pytest.raises(InvalidValueError, match=f"^{re.escape(expected)}$") as caught:
            getattr(material, method)(*arguments)
        assert caught.value.field == name


@pytest.mark.usefixtures("as_shipped")
@pytest.mark.parametrize("method", ["f", "pdf", "weight"])
def test_directions_that_do_not_broadcast_are_refused(method):
    expected = (
        "Expected wi and wo to have shapes that broadcast, got (4, 3) and (2, 5, 3). "
        "Make their leading axes equal, or of length 1."
    )
    with pytest.raises(InvalidValueError, match=f"^{re.escape(expected)}$") as caught:
        getattr(bc.material("lambert + kurt"), method)(torch.ones(4, 3), torch.ones(2, 5, 3))
    assert caught.value.field == "wo"


@pytest.mark.usefixtures("as_shipped")
def test_sample_refuses_what_does_not_broadcast():
    with pytest.raises(
        InvalidValueError, match=r"^Expected wo and u to have .*, got \(4, 3\) and \(5, 3\)\. "
    ) as caught:
        bc.material("lambert + kurt").sample(torch.ones(4, 3), torch.full((5, 3), 0.5))
    assert caught.value.field == "u"


@pytest.mark.usefixtures("as_shipped")
@pytest.mark.parametrize(
    ("shape", "field"), [((1, 2), "wo"), ((), "wo"), ((1, 2), "u"), ((1, 4), "u"), ((), "u")], ids=str
)
def test_sample_refuses_wrong_shapes(shape, field):
    arguments = {"wo": torch.tensor([[0.0, 0.0, 1.0]]), "u": torch.full((1, 3), 0.5)} | {field: torch.full(shape, 0.5)}
    with pytest.raises(InvalidValueError, match=f"^Expected {field} to be ") as caught:
        bc.material("lambert + kurt").sample(**arguments)
    assert caught.value.field == field


@every_dtype
@every_choice
def test_channels_are_independent(choice, dtype):
    rng = np.random.default_rng(18)
    values = draw_values(choice, rng, where="search", channels=3)
    material = material_of(choice, values)
    wi, wo = lobe_pairs(material, rng, 50, dtype)
    f = material.f(wi, wo)
    assert f.shape == (len(wi), 3)
    for channel in range(3):
        one = {name: value[channel] if isinstance(value, list) else value for name, value in values.items()}
        assert close(f[:, channel : channel + 1], material_of(choice, one).f(wi, wo))


@every_choice
def test_a_gray_material_has_one_channel_and_equals_equal_channels(choice):
    rng = np.random.default_rng(19)
    values = draw_values(choice, rng, where="search")
    gray = material_of(choice, values)
    wi, wo = lobe_pairs(gray, rng, 50)
    equal = {p.name: [values[p.name]] * 3 if p.per_channel != "no" else values[p.name] for p in choice.parameters}
    coloured = material_of(choice, equal)
    assert gray.channels == 1
    assert gray.f(wi, wo).shape == (len(wi), 1)
    assert close(coloured.f(wi, wo), gray.f(wi, wo).expand(-1, 3))
    assert torch.equal(coloured.pdf(wi, wo), gray.pdf(wi, wo))
    one_of_one = material_of(choice, {name: v[:1] if isinstance(v, list) else v for name, v in equal.items()})
    assert one_of_one.f(wi, wo).shape == (len(wi), 1)


ISOTROPIC = [choice for choice in CHOICES if "isotropic" in choice.options]
# without what has no azimuth, and makes samples far from the lobe, where Q is large
LOBES_ALONE = [choice for choice in ISOTROPIC if "compensated" not in choice.options]


@every_dtype
@pytest.mark.parametrize(
    "choice",
    [c if c in COVERING else pytest.param(c, marks=pytest.mark.full) for c in LOBES_ALONE],
    ids=[name_of(c) for c in LOBES_ALONE],
)
def test_equal_widths_are_isotropic(choice, dtype):
    rng = np.random.default_rng(20)
    words = ["anisotropic" if word == "isotropic" else word for word in choice.options]
    other = bc.MODELS[choice.name](words)
    values = draw_values(choice, rng, where="search", channels=3)
    (width,) = choice.width_names
    split = {name: value for name, value in values.items() if name != width} | dict.fromkeys(
        other.width_names, values[width]
    )
    wi, wo = lobe_pairs(material_of(choice, values), rng, 100, dtype)
    one, two = material_of(choice, values), material_of(other, split)
    assert close(two.f(wi, wo), one.f(wi, wo), factor=160)  # the bar of Q <= 20 on both sides
    assert close(two.pdf(wi, wo), one.pdf(wi, wo), factor=160)
    u = torch.tensor(rng.uniform(0, 1, (len(wo), 3)), dtype=dtype)
    assert float((two.sample(wo, u) - one.sample(wo, u)).detach().abs().max()) <= 16 * EPS[dtype]


@pytest.mark.parametrize("choice", LOBES_ALONE, ids=lambda c: f"{c.name}({','.join(c.options)})")
def test_an_isotropic_lobe_turns_with_its_directions(choice):
    rng = np.random.default_rng(21)
    material = material_of(choice, draw_values(choice, rng, where="mild"))
    wi, wo = lobe_pairs(material, rng, 50)
    turn = torch.tensor([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64)
    assert close(material.f(wi @ turn.T, wo @ turn.T), material.f(wi, wo), factor=400)


ANISOTROPIC = [choice for choice in CHOICES if "anisotropic" in choice.options]


@pytest.mark.parametrize("choice", ANISOTROPIC, ids=lambda c: f"{c.name}({','.join(c.options)})")
def test_swapping_the_widths_turns_an_anisotropic_lobe(choice):
    """x and y are not mixed up anywhere: (ax, ay) at (x, y) is (ay, ax) at (y, x)."""
    rng = np.random.default_rng(22)
    values = draw_values(choice, rng, where="mild")
    one, two = choice.width_names
    swapped = values | {one: values[two], two: values[one]}
    wi, wo = lobe_pairs(material_of(choice, values), rng, 50)
    order = torch.tensor([1, 0, 2])
    f, g = material_of(choice, values).f(wi, wo), material_of(choice, swapped).f(wi[:, order], wo[:, order])
    assert close(g, f, factor=200)
    assert not close(material_of(choice, swapped).f(wi, wo), f, factor=1e6)


def test_the_width_along_x_widens_the_lobe_along_x():
    for text in (
        "ward(ax=0.5, ay=0.05)",
        "kurt(mx=0.5, my=0.05)",
        "kurt_plausible(mx=0.5, my=0.05)",
        "ashikhmin_shirley(nu=5, nv=500)",
    ):
        wo = torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64)
        along = torch.tensor([[0.3, 0.0, 0.91**0.5], [0.0, 0.3, 0.91**0.5]], dtype=torch.float64)
        along_x, along_y = bc.material(text).f(along, wo)[:, 0].tolist()
        assert along_x > 10 * along_y


PAIRS = [
    ("coupled_lambert(kd=0.3, f0=kurt.f0) + kurt(f0=0.07)", "coupled_lambert(kd=0.3, f0=0.07) + kurt(f0=0.07)"),
    (
        "ashikhmin_shirley(f0=[0.1, 0.2, 0.3]) + ashikhmin_shirley_diffuse(f0=ashikhmin_shirley.f0)",
        "ashikhmin_shirley(f0=[0.1, 0.2, 0.3]) + ashikhmin_shirley_diffuse(f0=[0.1, 0.2, 0.3])",
    ),
    ("kurt(m=0.2) + kurt(m=kurt.m, f0=kurt.f0)", "kurt(m=0.2) + kurt(m=0.2)"),
    ("lambert(kd=0.175 - ward.rs) + ward(rs=0.05)", "lambert(kd=0.125) + ward(rs=0.05)"),
    (
        "lambert(kd=[0.2, 0.3, 0.4] - ward.rs) + ward(rs=0.05)",
        "lambert(kd=[0.15, 0.25, 0.35]) + ward(rs=0.05)",
    ),
    (
        "lambert(kd=0.5 - ward.rs) + ward(rs=[0.05, 0.1, 0.2])",
        "lambert(kd=[0.45, 0.4, 0.3]) + ward(rs=[0.05, 0.1, 0.2])",
    ),
    (
        "lambert(kd=[0.2, 0.3] - ward.rs) + ward(rs=[0.05, 0.1])",
        "lambert(kd=[0.15, 0.2]) + ward(rs=[0.05, 0.1])",
    ),
]


@pytest.mark.parametrize(("tied", "copied"), PAIRS)
@every_dtype
def test_a_tie_equals_copying_the_value(tied, copied, dtype):
    rng = np.random.default_rng(23)
    one, other = bc.material(tied), bc.material(copied)
    wi, wo = lobe_pairs(one, rng, 50, dtype)
    assert one.channels == other.channels
    assert close(one.f(wi, wo), other.f(wi, wo))
    assert close(one.pdf(wi, wo), other.pdf(wi, wo))
    u = torch.tensor(rng.uniform(0, 1, (len(wo), 3)), dtype=dtype)
    assert close(one.sample(wo, u), other.sample(wo, u))


def test_the_owner_of_a_tie_gets_both_gradients():
    wi, wo = (torch.tensor(w, dtype=torch.float64) for w in ([0.1, 0.0, 0.99**0.5], [0.0, 0.2, 0.96**0.5]))
    tied = bc.material("lambert(kd=0.5 - ward.rs) + ward(rs=0.1)")
    copied = bc.material("lambert(kd=0.4) + ward(rs=0.1)")
    for material in (tied, copied):
        material.f(wi, wo).sum().backward()
    by_rs, by_kd = copied.raw["ward"]["rs"].grad, copied.raw["lambert"]["kd"].grad
    assert tied.raw["ward"]["rs"].grad.item() == pytest.approx((by_rs - by_kd).item(), rel=1e-14)
    assert "lambert.kd" not in tied.values()


def test_a_sum_is_the_sum_of_its_terms():
    rng = np.random.default_rng(24)
    parts = [material_of(choice, draw_values(choice, rng, where="mild", channels=3)) for choice in CHOICES]
    whole = bc.material(" + ".join(str(part) for part in parts))
    parts = [bc.material(str(part)) for part in parts]
    wi, wo = hemisphere(rng, 100), hemisphere(rng, 100)
    assert close(whole.f(wi, wo), sum(part.f(wi, wo) for part in parts), factor=64)


@every_choice
def test_the_scale_multiplies_the_whole_term(choice):
    """`scale` names the reflectance of which f is a multiple where all else is held."""
    if choice.scale not in choice.parameter:
        assert choice in (
            *bc.MODELS["ashikhmin_shirley"].with_words(["schlick"]),  # the paper's own form, without ks
            *bc.MODELS["oren_nayar"].with_words(["energy_preserving"]),  # further reflections go with higher powers
        )
        return
    rng = np.random.default_rng(25)
    values = draw_values(choice, rng, where="mild")
    wi, wo = lobe_pairs(material_of(choice, values), rng, 20)
    whole, part = (material_of(choice, values | {choice.scale: x}).f(wi, wo) for x in (1.0, 0.25))
    assert close(part, whole / 4)


@every_choice
def test_non_contiguous_and_expanded_directions(choice):
    rng = np.random.default_rng(26)
    material = material_of(choice, draw_values(choice, rng, where="mild"))
    wi, wo = lobe_pairs(material, rng, 20)
    strided = torch.stack([wi, wo], dim=-1)
    assert torch.equal(material.f(strided[..., 0], strided[..., 1]), material.f(wi, wo))
    assert torch.equal(material.f(wi[:1].expand(20, 3), wo), material.f(wi[:1], wo))


@every_choice
def test_defaults_and_search_ranges_lie_in_the_boxes(choice):
    rng = np.random.default_rng(27)
    for p in choice.parameters:
        low, high = p.search_range
        for value in (p.default, low, high, *(draw_value(p, rng, where=w) for w in ("box", "search", "mild"))):
            assert bool(p.contains(torch.tensor(value, dtype=torch.float64))), (p.name, value)
        assert low < high
        assert np.isfinite([low, high]).all()
        assert p.scale == "linear" or p.low > 0
        assert re.search(r"\[.+\]$", p.description), "the unit ends the description"


@pytest.mark.usefixtures("as_shipped")
def test_arrays_that_are_no_tensors_are_refused():
    material, w = bc.material("lambert + kurt"), np.array([[0.0, 0.0, 1.0]])
    with pytest.raises((InvalidValueError, TypeError)) as caught:
        material.f(w, w)
    assert "float32 or float64, got float64" not in str(caught.value), "the sentence contradicts itself"


@every_dtype
@pytest.mark.parametrize("where", range(3))
def test_a_direction_that_is_no_number_gives_no_number(where, dtype):
    """A NaN that comes in is the caller's to find: it is not answered with a plausible 0."""
    material = bc.material("lambert(kd=0.2) + kurt + ashikhmin_shirley(nu=10, nv=20)")
    good = torch.tensor([[0.6, 0.0, 0.8]], dtype=dtype)
    bad = good.clone()
    bad[0, where] = torch.nan
    for method in ("f", "pdf", "weight"):
        for arguments in ((bad, good), (good, bad)):
            assert getattr(material, method)(*arguments).isnan().all()


@every_dtype
@pytest.mark.parametrize("where", range(3))
@pytest.mark.parametrize(
    "text", ["ward", "kurt(anisotropic)", "blinn_phong", "ggx", "beckmann", "lafortune", "edwards"]
)
def test_what_is_sampled_for_no_number_is_no_number(text, where, dtype):
    wo, u = torch.tensor([0.6, 0.0, 0.8], dtype=dtype), torch.tensor([0.5, 0.3, 0.7], dtype=dtype)
    material = bc.material(text)
    assert material.sample(wo, u).isfinite().all()
    wo[where] = torch.nan
    assert material.sample(wo, u).isnan().any()
