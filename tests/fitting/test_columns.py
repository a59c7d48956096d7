"""The columns that values and derivatives are mixed from, and what computing them does not cost."""

import subprocess
import sys

import pytest
import torch
from fit_cases import measured_from

import brdfcore as bc
from brdfcore.fitting.losses import LOSSES
from brdfcore.fitting.plan import plan
from brdfcore.fitting.problem import Problem

CHOICES = [choice for model in bc.MODELS.values() for choice in model.with_words(())]


@pytest.mark.parametrize("choice", CHOICES, ids=lambda choice: f"{choice.name}({','.join(choice.options)})")
def test_columns_are_the_models_bases_and_their_derivatives(choice: bc.Model) -> None:
    text = f"{choice.name}({', '.join(choice.options)})" if choice.options else choice.name
    check_columns(text, {})


@pytest.mark.parametrize(
    ("text", "fixed"),
    [
        ("kurt(isotropic, dielectric)", {"kurt.eta": 1.5}),
        ("kurt(anisotropic)", {"kurt.mx": 0.2}),
        ("kurt(isotropic)", {"kurt.m": 0.2, "kurt.alpha": 0.1}),
    ],
)
def test_columns_of_values_that_are_fixed(text: str, fixed: dict[str, float]) -> None:
    check_columns(text, fixed)


def test_columns_of_a_tied_width() -> None:
    check_columns("ward + kurt(m=ward.a)", {})


def check_columns(text: str, fixed: dict[str, float]) -> None:
    """Against each model's own `basis`, differentiated sample by sample in central differences."""
    samples = measured_from("lambert(kd=0.2)", count=12)
    problem = Problem(plan(1, text, fixed=fixed), samples, LOSSES["cosine"])
    x = problem.pack(problem.plan.start).unsqueeze(0)
    columns = problem.columns.all(problem.natural(x), problem.data.g, 1, 1)[0, 0]
    form = problem.plan.form

    def bases(values: dict[str, torch.Tensor]) -> torch.Tensor:
        each = [term.model.basis(form.of_term(term, values), problem.data.g) for term in form.terms]
        return torch.stack([basis.detach().expand(12, 1)[:, 0] for found in each for basis in found])

    start = problem.plan.start
    torch.testing.assert_close(columns[: problem.columns.bases], bases(start), rtol=1e-12, atol=0)
    for j, (k, p) in enumerate(problem.columns.derivatives):
        key = problem.keys[p]
        step = 1e-5 * float(start[key])
        up, down = ({**start, key: start[key] + sign * step} for sign in (1, -1))
        expected = (bases(up)[k] - bases(down)[k]) / (2 * step)
        size = float(bases(start)[k].abs().max() / start[key].abs())
        torch.testing.assert_close(columns[problem.columns.bases + j], expected, rtol=1e-5, atol=1e-6 * size)


def test_a_fit_imports_no_second_half_of_torch() -> None:
    """Jacobian-vector products and vmap would import hundreds of modules, which costs seconds on the first fit."""
    script = (
        "import sys, brdfcore as bc; from brdfcore.demo import DATA, MODEL; samples = bc.read(DATA); "
        "before = set(sys.modules); bc.fit(samples, MODEL, loss='log'); bc.fit(samples, MODEL); "
        "print(*sorted(set(sys.modules) - before))"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120, check=True)
    new = run.stdout.split()
    assert not [name for name in new if name.startswith(("torch._decomp", "torch.fx", "torch._functorch"))]
    assert len(new) < 64
