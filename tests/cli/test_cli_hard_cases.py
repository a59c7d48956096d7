"""`brdf check --hard-cases`: what it prints, what it answers, and what it refuses."""

import json
import math
import pathlib
import sys
from collections.abc import Callable
from dataclasses import replace

import jaxtyping
import pytest

import brdfcore as bc
from brdfcore import hard_cases
from brdfcore.cli import main
from brdfcore.hard_cases import ModelReport

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path) -> Run:
    """Runs the command in this process; gives its exit code and what it printed on its output and its error output."""
    monkeypatch.chdir(tmp_path)
    jaxtyping.config.update("jaxtyping_disable", True)  # the tests' checks would refuse half precision first

    def typed(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["brdf", "check", *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
        return int(ended.value.code or 0), *capsys.readouterr()

    yield typed
    jaxtyping.config.update("jaxtyping_disable", False)


def spoilt(report: ModelReport) -> ModelReport:
    """The report, were the library's gradient NaN in its first case."""
    first, *rest = report.cases
    worst = {**first.worst}
    worst["gradient", "float32"] = replace(worst["gradient", "float32"], ours=math.nan, share=math.nan)
    return replace(report, cases=(replace(first, worst=worst), *rest))


def test_a_models_table_fits_100_columns_and_ends_in_one_sentence(run: Run) -> None:
    code, printed, _ = run("--hard-cases", "lambert")
    assert code == 0
    assert max(map(len, printed.splitlines())) <= 100
    for case in hard_cases.catalogue(bc.MODELS["lambert"]):
        assert case.name in printed
        assert case.why in printed
    flat = " ".join(printed.split())
    assert "As printed, 3 of 18 cases break: NaN, infinite, or more than 1 % off. Ours is off by at most" in flat
    assert "float16 is refused: Expected wi to be float32 or float64, got torch.float16." in flat
    assert "bfloat16 is refused: " in flat


def test_json_is_the_librarys_report(run: Run) -> None:
    code, printed, _ = run("--hard-cases", "lambert", "--json")
    assert code == 0
    assert json.loads(printed) == hard_cases.check(bc.MODELS["lambert"]).to_dict()


def test_without_a_name_it_checks_every_model(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    report = hard_cases.check(bc.MODELS["lambert"])
    monkeypatch.setattr(hard_cases, "check", lambda model: replace(report, model=model))
    code, printed, _ = run("--hard-cases")
    assert code == 0
    assert f"{len(bc.MODELS)} models, {18 * len(bc.MODELS)} cases: as printed, {3 * len(bc.MODELS)} break; " in printed
    assert all(f"\n{name}: " in printed for name in bc.MODELS)
    described = json.loads(run("--hard-cases", "--json")[1])
    assert [item["model"] for item in described["items"]] == list(bc.MODELS)


def test_a_missed_bar_is_named_and_makes_exit_code_1(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    report = spoilt(hard_cases.check(bc.MODELS["lambert"]))
    monkeypatch.setattr(hard_cases, "check", lambda model: report)
    code, printed, _ = run("--hard-cases", "lambert")
    assert code == 1
    assert (
        "Ours misses its bar:\nlight and viewer at the normal: gradient in float32, lambert(kd=0.2), wi = " in printed
    )
    code, printed, _ = run("--hard-cases", "lambert", "--json")
    assert code == 1
    assert json.loads(printed)["within_bar"] is False
    code, printed, _ = run("--hard-cases")
    assert code == 1
    assert "missed their bars." in " ".join(printed.split())


def test_an_unknown_model_is_one_sentence(run: Run) -> None:
    code, _, said = run("--hard-cases", "kurtt")
    assert code == 2
    assert said.startswith(
        "brdf: Expected a model to be a known name, got 'kurtt'. Did you mean 'kurt'? Known: lambert, "
    )


def test_nothing_to_check_is_one_sentence(run: Run) -> None:
    code, _, said = run()
    assert code == 2
    assert said == (
        "brdf: Expected brdf check to be told what to check, got nothing. Name a material, or add --hard-cases.\n"
    )
