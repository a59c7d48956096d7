"""Variable projection: what it claims of its residual is true of the material, for every model, tie and colour."""

from typing import Any

import pytest
import torch
from fit_cases import measured_from

import brdfcore as bc
from brdfcore.fitting.losses import LOSSES
from brdfcore.fitting.plan import plan
from brdfcore.fitting.problem import Problem
from brdfcore.fitting.projection import Projection
from brdfcore.models.form import Form, Term

NOISY = "lambert(kd=[0.1, 0.2, 0.3]) + kurt(isotropic, ks=[0.3, 0.2, 0.4], f0=0.1, m=0.3, alpha=0.2)"
CHOICES = [choice for model in bc.MODELS.values() for choice in model.with_words(())]
TIES = {
    "coupled to a lobe's f0": "coupled_lambert(f0=kurt.f0) + kurt(isotropic)",
    "coupled after its lobe": "kurt(isotropic) + coupled_lambert(f0=kurt.f0)",
    "coupled to f0 of its own": "coupled_lambert + kurt(isotropic)",
    "the paper's A&S": "ashikhmin_shirley(isotropic) + ashikhmin_shirley_diffuse(f0=ashikhmin_shirley.f0)",
    "A&S with two readers": "ashikhmin_shirley(isotropic) + ashikhmin_shirley_diffuse(f0=ashikhmin_shirley.f0)"
    " + coupled_lambert(f0=ashikhmin_shirley.f0)",
    "a known total": "lambert(kd=[0.3, 0.4, 0.5] - ward.rs) + ward(isotropic)",
    "two lobes of one reflectance": "lambert + ward(isotropic) + ward(isotropic, rs=ward.rs)",
    "two lobes of one f0": "lambert + kurt(isotropic) + kurt(isotropic, f0=kurt.f0)",
    "two pairs": "lambert + kurt(isotropic) + kurt(isotropic, m=0.5)",
    "three pairs": "kurt(isotropic) + kurt(isotropic, m=0.5) + kurt(isotropic, m=0.05)",
    "equal terms": "lambert + lambert + ward(isotropic)",
}
COLOURS: dict[str, dict[str, Any]] = {
    "one channel": {},
    "three channels": {},
    "gray": {"gray": "all"},
    "gray diffuse": {"gray": "kd"},
    "f0 a channel": {"per_channel": "f0"},
}

RARE = {"dielectric", "conductor", "separable", "energy_preserving"}  # words that change no more than a basis
CASES = [
    pytest.param(
        choice,
        colour,
        marks=[pytest.mark.full] if RARE & set(choice.options) and colour != "f0 a channel" else [],
        id=f"{choice.name}({','.join(choice.options)})-{colour}",
    )
    for choice in CHOICES
    for colour in COLOURS
]


def seen(channels: int, weigh: bool = False) -> bc.Samples:
    samples = measured_from(NOISY, count=40, noise=0.05, sigma=weigh)
    sigma = None if samples.sigma is None else samples.sigma[:, :channels] * (1 + torch.arange(float(channels)))
    return bc.Samples(samples.wi, samples.wo, samples.values[:, :channels], sigma=sigma)


def problem_of(text: str, colour: str, loss: str = "cosine", weigh: bool = False) -> Problem:
    channels = 1 if colour == "one channel" else 3
    form = plan(3, text).form
    keywords: dict[str, Any] = {}
    for name, which in COLOURS[colour].items():
        keys = [k for k, p in form.parameters.items() if p.per_channel != "no"]
        keywords[name] = [k for k in keys if which == "all" or k.endswith(which)]
    return Problem(plan(channels, text, **keywords), seen(channels, weigh), LOSSES[loss])


def points(problem: Problem, count: int = 3) -> torch.Tensor:
    """Points in the search ranges, no two values alike."""
    unit = torch.rand(count, problem.size, generator=torch.Generator().manual_seed(5), dtype=torch.float64)
    low, high = problem.low.clone(), problem.high.clone()
    for key, at in problem.slices.items():
        parameter = problem.plan.form.parameters[key]
        ends = parameter.to_raw(torch.tensor(parameter.search_range, dtype=torch.float64))
        low[at], high[at] = torch.maximum(low[at], ends[0]), torch.minimum(high[at], ends[1])
    return low + (0.2 + 0.6 * unit) * (high - low)


def check(problem: Problem) -> None:
    """What the projection claims, by the whole problem's own residuals and derivatives at the point it returns."""
    projection = Projection(problem)
    if not projection.useful:
        assert "energy_preserving" in problem.plan.form.text()
        return
    x, claimed = projection.gram(points(problem))
    whole = problem.gram(x)
    unit = float(problem.squares)
    clipped = whole.loss > claimed.loss + 1e-9 * unit  # outside the box before it was put into it
    if not projection.may_leave_the_box:
        assert not bool(clipped.any())
    torch.testing.assert_close(whole.loss[~clipped], claimed.loss[~clipped], rtol=1e-9, atol=1e-11 * unit)
    # first-order conditions: no reflectance can gain, and the shapes' gradient is that of the whole problem
    scale = (whole.matrix.diagonal(dim1=-2, dim2=-1) * unit).sqrt().clamp(min=1e-9 * unit)
    gradient = torch.where(problem.held(x, whole.gradient), 0.0, whole.gradient) / scale
    shapes = torch.zeros(problem.size, dtype=torch.bool)
    for p in projection.shapes:
        shapes[problem.index[:, p]] = True
    assert bool((gradient[~clipped][:, ~shapes].abs() < 1e-6).all())
    expected = torch.where(claimed.gradient == 0, 0.0, whole.gradient)  # one that is lost in the reflectances is 0
    torch.testing.assert_close(
        (claimed.gradient / scale)[~clipped][:, shapes], (expected / scale)[~clipped][:, shapes], rtol=1e-6, atol=1e-9
    )


@pytest.mark.parametrize(("choice", "colour"), CASES)
def test_every_model_is_solved_exactly(choice: bc.Model, colour: str) -> None:
    check(problem_of("lambert + " + Form((Term(choice.name, choice),)).text(), colour))


@pytest.mark.parametrize("colour", COLOURS)
@pytest.mark.parametrize("tie", TIES)
def test_ties_are_solved_exactly(tie: str, colour: str) -> None:
    if tie == "a known total" and colour == "one channel":
        check(problem_of("lambert(kd=0.4 - ward.rs) + ward(isotropic)", colour))
    else:
        check(problem_of(TIES[tie], colour))


@pytest.mark.parametrize("weigh", [False, True])
@pytest.mark.parametrize("loss", ["cosine", "l2", "relative"])
def test_weights_that_differ_by_channel_are_solved_exactly(loss: str, weigh: bool) -> None:
    check(problem_of("lambert + kurt(isotropic)", "three channels", loss, weigh))


def test_other_losses_are_not_projected() -> None:
    assert not Projection(problem_of("lambert", "gray", "log")).useful


GROUPS = {
    "lambert + kurt(isotropic)": ("one channel", ["pair", "scale"], ["kurt.m", "kurt.alpha"]),
    "lambert + kurt(isotropic, dielectric)": ("one channel", ["scale", "scale"], ["kurt.eta", "kurt.m", "kurt.alpha"]),
    TIES["coupled to a lobe's f0"]: ("f0 a channel", ["pair", "absorbed"], ["kurt.m", "kurt.alpha"]),
    TIES["coupled to f0 of its own"]: (
        "three channels",
        ["scale", "scale"],
        ["coupled_lambert.f0", "kurt.f0", "kurt.m", "kurt.alpha"],
    ),
    TIES["the paper's A&S"]: ("three channels", ["f0", "absorbed"], ["ashikhmin_shirley.n"]),
    TIES["a known total"]: ("three channels", ["scale"], ["ward.a"]),
    TIES["two lobes of one reflectance"]: ("gray", ["scale", "scale"], ["ward.a", "ward_2.a"]),
}


@pytest.mark.parametrize("text", GROUPS)
def test_what_is_linear_is_found(text: str) -> None:
    colour, kinds, shapes = GROUPS[text]
    projection = Projection(problem_of(text, colour))
    assert [group.kind for group in projection.groups] == kinds
    assert [projection.problem.keys[p] for p in projection.shapes] == shapes


def test_an_f0_with_bounds_is_a_shape() -> None:
    made = plan(1, "lambert + kurt(isotropic)", bounds={"kurt.f0": (0.02, 0.1)})
    assert "kurt.f0" in [made.free[p] for p in Projection(Problem(made, seen(1), LOSSES["cosine"])).shapes]


def test_the_projected_matrix_is_kaufmans() -> None:
    """By the full Jacobian: the residual's derivative with z held, less its part in the span of the free columns."""
    problem = problem_of("lambert + kurt(isotropic)", "three channels")
    projection = Projection(problem)
    x, claimed = projection.gram(points(problem, 1))
    by_channel = problem.jacobian(x, problem.data)[1][0]
    full = torch.zeros(3, len(problem.data.c), problem.size, dtype=torch.float64)
    for c in range(3):
        full[c, :, problem.index[c]] = by_channel[c].T
    full = full.reshape(-1, problem.size)
    shapes = [int(problem.index[0, p]) for p in projection.shapes]
    free = [d for d in range(problem.size) if d not in shapes and problem.low[d] < x[0, d] < problem.high[d]]
    span, across = full[:, free], full[:, shapes]
    left = across - span @ torch.linalg.lstsq(span, across).solution
    torch.testing.assert_close(claimed.matrix[0][shapes][:, shapes], left.T @ left, rtol=1e-8, atol=1e-12)
