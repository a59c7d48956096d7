"""A fit's residuals, exact derivatives and bounds."""

import pytest
import torch
from fit_cases import measured_from

import brdfcore as bc
from brdfcore.fitting.losses import LOSSES, Scales
from brdfcore.fitting.plan import plan
from brdfcore.fitting.problem import Problem
from brdfcore.geometry import geometry

RGB = "lambert(kd=[0.1, 0.2, 0.3]) + ward(rs=[0.05, 0.1, 0.1], a=0.2)"
CASES = {
    "plain": ("lambert + ward_bounded", {}),
    "anisotropic": ("lambert + kurt(anisotropic, alpha=0.3)", {}),
    "gray": ("lambert + kurt(isotropic)", {"gray": ("lambert.kd",)}),
    "colour in f0": ("lambert + kurt(isotropic)", {"per_channel": ("kurt.f0",)}),
    "fixed": ("lambert + kurt(isotropic)", {"fixed": {"kurt.f0": 0.1, "lambert.kd": [0.1, 0.2, 0.3]}}),
    "coupled": ("coupled_lambert(f0=kurt.f0) + kurt(isotropic)", {}),
    "paper's A&S": ("ashikhmin_shirley + ashikhmin_shirley_diffuse(f0=ashikhmin_shirley.f0)", {}),
    "known total": ("lambert(kd=[0.3, 0.4, 0.5] - ward.rs) + ward(isotropic)", {}),
    "two lobes": ("lambert + ward(isotropic) + ward(isotropic, a=0.4)", {}),
}


@pytest.fixture(scope="module")
def samples() -> bc.Samples:
    return measured_from(RGB, count=40, noise=0.01)


def problem_of(samples: bc.Samples, text: str, loss: str = "cosine", **keywords: object) -> Problem:
    made = plan(3, text, azimuth_observed=samples.azimuth_observed, **keywords)
    return Problem(made, samples, LOSSES[loss])


def inside(problem: Problem, seed: int = 0) -> torch.Tensor:
    """A point well inside the box, no two values alike."""
    unit = torch.rand(problem.size, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)
    low, high = problem.low.clamp(min=-3), problem.high.clamp(max=3)
    return low + (0.2 + 0.3 * unit) * (high - low)


@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("case", CASES)
def test_normal_equations_are_the_jacobians(samples: bc.Samples, case: str, loss: str) -> None:
    """The compressed Jacobian, scattered, equals the full one that autograd gives."""
    text, keywords = CASES[case]
    problem = problem_of(samples, text, loss, **keywords)
    x = inside(problem)
    form, c = problem.plan.form, samples.wi[:, 2:]
    g, scales = geometry(samples.wi, samples.wo, form.needs), Scales.of(samples.values, c)

    def defined(v: torch.Tensor) -> torch.Tensor:
        return LOSSES[loss].difference(form.f(problem.unpack(v), g), samples.values, c, scales).reshape(-1)

    residuals = defined(x)
    full = torch.autograd.functional.jacobian(defined, x)
    gram = problem.gram(x.unsqueeze(0))
    total, gradient = problem.gradient(x.unsqueeze(0))
    torch.testing.assert_close(total, gram.loss, rtol=1e-12, atol=0)
    torch.testing.assert_close(gradient, gram.gradient, rtol=1e-10, atol=1e-12)
    assert float(gram.loss) == pytest.approx(float(residuals.square().sum()), rel=1e-13)
    torch.testing.assert_close(gram.matrix[0], full.T @ full, rtol=1e-10, atol=1e-12)
    torch.testing.assert_close(gram.gradient[0], full.T @ residuals.reshape(-1), rtol=1e-10, atol=1e-12)
    torch.testing.assert_close(problem.loss(x.unsqueeze(0)), gram.loss)


def test_a_batch_of_starts_equals_one_by_one(samples: bc.Samples) -> None:
    problem = problem_of(samples, "lambert + kurt(isotropic)")
    x = torch.stack([inside(problem, seed) for seed in range(4)])
    together = problem.gram(x)
    for i in range(4):
        for part, single in zip(together, problem.gram(x[i : i + 1]), strict=True):
            torch.testing.assert_close(part[i], single[0])


def test_chunks_change_nothing(samples: bc.Samples, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = problem_of(samples, "lambert + kurt(isotropic)")
    x = inside(problem).unsqueeze(0)
    whole = problem.gram(x)
    monkeypatch.setattr("brdfcore.fitting.data._CHUNK", 11)
    assert len(list(problem.data.chunks(1))) > 3
    for part, other in zip(whole, problem.gram(x), strict=True):
        torch.testing.assert_close(part, other)


def test_pack_and_unpack_are_inverse(samples: bc.Samples) -> None:
    problem = problem_of(samples, "lambert + kurt(isotropic)", fixed={"kurt.alpha": 0.2})
    x = inside(problem)
    values = problem.unpack(x)
    assert float(values["kurt.alpha"]) == 0.2
    torch.testing.assert_close(problem.pack(values), x)


def test_a_known_total_bounds_its_owner(samples: bc.Samples) -> None:
    problem = problem_of(samples, "lambert(kd=[0.3, 0.4, 0.5] - ward.rs) + ward(isotropic)")
    at = problem.slices["ward.rs"]
    assert problem.low[at].tolist() == [0, 0, 0]
    assert problem.high[at].tolist() == pytest.approx([0.3, 0.4, 0.5], abs=1e-15)


def test_sigma_makes_the_cosine_loss_chi_square() -> None:
    samples = measured_from("lambert(kd=0.2)", count=30, noise=0.01, sigma=True)
    problem = Problem(plan(1, "lambert"), samples, LOSSES["cosine"])
    x = torch.tensor([[0.15]], dtype=torch.float64)
    expected = (((0.15 / torch.pi - samples.values) / samples.sigma) ** 2).sum()
    assert float(problem.loss(x)) == pytest.approx(float(expected), rel=1e-12)


@pytest.mark.parametrize("channels", [1, 3])
def test_gradients_are_those_of_each_rows_own_material(samples: bc.Samples, channels: int) -> None:
    several = [bc.Samples(samples.wi, samples.wo, k * samples.values[:, :channels]) for k in (1.0, 0.5)]
    made = plan(channels, "lambert + kurt(isotropic)", azimuth_observed=True)
    problem = Problem(made, several, LOSSES["log"])
    x, which = torch.stack([inside(problem, seed) for seed in range(3)]), torch.tensor([1, 0, 1])
    gram, (loss, gradient) = problem.gram(x, which), problem.gradient(x, which)
    torch.testing.assert_close(loss, gram.loss, rtol=1e-12, atol=0)
    torch.testing.assert_close(gradient, gram.gradient, rtol=1e-10, atol=1e-12)
