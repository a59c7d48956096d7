"""The directional albedo as a function: derivatives in every parameter, shapes, what it says, and mistakes."""

import math

import numpy as np
import pytest
import torch
from albedo_cases import form_of, prepared

import brdfcore as bc
from brdfcore.energy import refinement
from brdfcore.energy.plan import plan
from brdfcore.errors import InvalidValueError, UnknownNameError

COSINES = torch.tensor([0.9, 0.3], dtype=torch.float64)
AZIMUTH = torch.tensor(0.7, dtype=torch.float64)


def moderate(choice: bc.Model, seed: int) -> dict[str, torch.Tensor]:
    """Values inside the search ranges."""
    rng = np.random.default_rng(seed)
    values = {}
    for parameter in choice.parameters:
        low, high = parameter.search_range
        share = rng.uniform(0.3, 0.7)
        log = parameter.scale == "log"
        values[f"{choice.name}.{parameter.name}"] = torch.tensor(
            math.exp(math.log(low) + share * math.log(high / low)) if log else low + share * (high - low),
            dtype=torch.float64,
        )
    return values


FIRST = [model.choices()[0] for model in bc.MODELS.values()]
OTHERS = [
    bc.MODELS["ward_bounded"](("anisotropic",)),
    bc.MODELS["ashikhmin_shirley"](("anisotropic",)),
    bc.MODELS["kurt"](("anisotropic", "conductor")),
    bc.MODELS["ggx"](("isotropic", "separable", "schlick", "compensated")),
    bc.MODELS["oren_nayar"](("energy_preserving",)),
]


@pytest.mark.parametrize("choice", [*FIRST, *OTHERS], ids=str)
def test_gradcheck_in_every_parameter(choice):
    """At the nodes that were chosen, against differences of the same rule."""
    form, values = form_of(choice), moderate(choice, 3)
    chosen = plan(form, values, COSINES, AZIMUTH, 1e-8)
    names, inputs = list(values), [value.requires_grad_() for value in values.values()]

    def f(*given: torch.Tensor) -> torch.Tensor:
        return chosen.evaluate(dict(zip(names, given, strict=True)))

    assert torch.allclose(f(*inputs), chosen.found, rtol=0, atol=1e-13)
    assert torch.autograd.gradcheck(f, inputs, eps=1e-7, atol=1e-6, rtol=1e-5)


@pytest.mark.parametrize("remembered", [refinement.REMEMBERED, 0])
@pytest.mark.parametrize("text", ["ward_bounded(a=0.2)", "kurt(m=0.3)", "ggx(ax=0.2, ay=0.4, f0=0.3)"])
def test_derivatives_are_those_of_the_albedo_itself(text, remembered, monkeypatch):
    """Against differences of albedos whose nodes follow the values, whether or not nodes are remembered."""
    monkeypatch.setattr(refinement, "REMEMBERED", remembered)
    material = bc.material(text)
    raw = [parameter for parameter in material.parameters() if parameter.requires_grad]
    slopes = torch.autograd.grad(bc.albedo(material, 1.0, 0.3, tolerance=1e-11).values.sum(), raw)
    for parameter, slope in zip(raw, slopes, strict=True):
        sides = []
        for step in (1e-5, -1e-5):
            with torch.no_grad():
                parameter += step
                sides.append(float(bc.albedo(material, 1.0, 0.3, tolerance=1e-12).values.sum()))
                parameter -= step
        assert float(slope) == pytest.approx((sides[0] - sides[1]) / 2e-5, rel=1e-5, abs=1e-7)


def test_a_plan_is_batched_by_vmap():
    form, values = prepared("ward_duer(rs=0.5, a=0.2)")
    chosen = plan(form, values, COSINES, AZIMUTH, 1e-6)
    widths = torch.tensor([0.19, 0.2, 0.21], dtype=torch.float64)
    found = torch.func.vmap(lambda a: chosen.evaluate(values | {"ward_duer.a": a}))(widths)
    alone = torch.stack([chosen.evaluate(values | {"ward_duer.a": a}) for a in widths])
    assert torch.allclose(found, alone, rtol=1e-12)


def test_angles_broadcast_and_channels_come_last():
    material = bc.material("lambert(kd=[0.1, 0.2, 0.3]) + ward_bounded(rs=[0.1, 0.2, 0.3], ax=0.1, ay=0.3)")
    theta, phi = torch.linspace(0, 1.5, 4)[:, None], torch.linspace(0, 1, 3)
    with torch.no_grad():
        found = bc.albedo(material, theta, phi)
        one = bc.albedo(material, 1.5, 0.5)
    assert found.values.shape == found.error.shape == (4, 3, 3)
    assert one.values.shape == (3,)
    assert torch.allclose(found.values[3, 1], one.values, rtol=0, atol=2e-6)
    assert found.method == "closed_form"
    assert found.met
    assert found.evaluations > 0
    assert found.seconds > 0


def test_a_parameter_may_be_an_axis():
    form, values = prepared("ggx(ks=1, f0=0.5, a=0.2)")
    widths = torch.tensor([0.1, 0.5, 1.0], dtype=torch.float64)
    found = bc.energy.of_form(form, values | {"ggx.a": widths[:, None]}, COSINES[:, None], AZIMUTH, 1e-9).values
    for k, width in enumerate(widths):
        alone = bc.energy.of_form(form, values | {"ggx.a": width}, COSINES, AZIMUTH, 1e-9).values
        assert torch.allclose(found[:, k], alone, rtol=0, atol=2e-9)


def test_what_cannot_be_met_says_so():
    """Lafortune's lobe overflows: nothing is claimed."""
    with torch.no_grad():
        found = bc.albedo(bc.material("lafortune(ks=1, cx=-2, cy=-2, n=1000000)"), 1.0)
    assert not found.met
    assert math.isinf(float(found.error))


@pytest.mark.parametrize("theta", [1.6, -0.1, math.nan])
def test_an_angle_that_is_none_is_refused(theta):
    with pytest.raises(
        InvalidValueError, match=r"^Expected theta to be in \[0, pi/2\), got (1\.6|-0\.1|nan)"
    ) as refused:
        bc.albedo(bc.material("ward"), theta)
    assert refused.value.field == "theta"


def test_mistakes_are_refused_in_a_sentence():
    form, values = prepared("lambert + ward")
    for cosine in (0.0, 1.5, math.nan):
        with pytest.raises(InvalidValueError, match=r"^Expected cos_o to be in \(0, 1\], got (0|1\.5|nan)\. Give the"):
            bc.energy.of_form(form, values, torch.tensor(cosine), AZIMUTH)
    with pytest.raises(InvalidValueError, match=r"^Expected azimuth to be a number, got one that is not finite\."):
        bc.albedo(bc.material("ward"), 0.5, math.inf)
    for tolerance in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(
            InvalidValueError, match=r"^Expected tolerance to be above 0, got (0|-1|nan|inf)\. It is the"
        ):
            bc.albedo(bc.material("ward"), 0.5, tolerance=tolerance)
    with pytest.raises(UnknownNameError, match="slope_disc"):
        bc.albedo(bc.material("ward"), 0.5, method="slope_disk")
    with pytest.raises(InvalidValueError, match=r"^Expected method to suit ward, got closed_form\. Use auto or slope_"):
        bc.albedo(bc.material("lambert + ward"), 0.5, method="closed_form")
