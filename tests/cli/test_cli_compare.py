"""`brdf compare` as it is typed."""

import json
import math
import pathlib
import sys

import pytest

import brdfcore as bc
from brdfcore.cli import main
from brdfcore.demo import DATA

MODELS = ["lambert", "lambert + ward_bounded"]
ASKED = [part for model in MODELS for part in ("--models", model)]


def typed(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["brdf", "compare", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    return int(ended.value.code or 0)


def test_it_prints_the_ranking_and_draws_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path
) -> None:
    plot = tmp_path / "errors.svg"
    assert typed(monkeypatch, str(DATA), *ASKED, "--losses", "l2", "--plot", str(plot)) == 0
    out = capsys.readouterr().out
    assert out.splitlines()[0].split() == ["model", "l2", "minimised*", "values", "seconds", "status"]
    assert out.splitlines()[1].startswith("1   lambert + ward_bounded ")
    assert f"Plot: {plot}" in out
    assert "red_linoleum.csv: 222 samples" in plot.read_text(encoding="utf-8")


def test_json_is_the_librarys_result(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--loss", "log", "--fixed", "ward_bounded.a=0.03", "--gray", "lambert.kd", "--seed", "2", "--json"]
    assert typed(monkeypatch, str(DATA), *ASKED, *options) == 0
    theirs = json.loads(capsys.readouterr().out)
    ours = bc.compare(
        bc.read(DATA), MODELS, "log", fixed={"ward_bounded.a": 0.03}, gray=["lambert.kd"], seed=2
    ).to_dict()
    for mine, other in zip(ours["ranking"], theirs["ranking"], strict=True):
        assert {k: mine[k] for k in ("rank", "model", "errors", "objective", "parameters")} == {
            k: other[k] for k in ("rank", "model", "errors", "objective", "parameters")
        }


def test_its_options_are_those_of_fit(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    given = [
        *("--optimizer", "least_squares", "--per-channel", "kurt.f0", "--bounds", "lambert.kd=0.1:0.3"),
        *("--starts", "kurt.m=0.1", "--robust", "cauchy", "--robust-scale", "0.5", "--max-theta-deg", "70"),
    ]
    assert typed(monkeypatch, str(DATA), "--models", "lambert + kurt", *given, "--conserve-energy", "--json") == 0
    (row,) = json.loads(capsys.readouterr().out)["ranking"]
    ours = bc.fit(
        bc.read(DATA),
        "lambert + kurt",
        optimizer="least_squares",
        per_channel=["kurt.f0"],
        bounds={"lambert.kd": (0.1, 0.3)},
        starts=[{"kurt.m": 0.1}],
        robust="cauchy",
        robust_scale=0.5,
        max_theta=math.radians(70),
        conserve_energy=True,
    ).to_dict()
    for name in ("parameters", "objective", "per_channel"):
        assert row["fit"][name] == ours[name]
    assert row["fit"]["conservation"] is not None
    assert row["fit"]["data"]["masked"] == ours["data"]["masked"] != []
    assert row["fit"]["cost"]["starts"] == ours["cost"]["starts"]


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["--losses", "cosin"], "Did you mean 'cosine'"),
        (["--models", "lambrt"], "Did you mean 'lambert'"),
        (["--plot", "x.pdf"], ".svg or .png"),
        (["--fixed", "lambert.kd"], "KEY=NUMBER"),
    ],
)
def test_a_mistake_is_one_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], arguments: list[str], part: str
) -> None:
    assert typed(monkeypatch, str(DATA), *arguments) == 2
    error = capsys.readouterr().err
    assert error.startswith("brdf: Expected ")
    assert part in error
    assert error.count("\n") == 1
