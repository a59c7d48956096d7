"""The README says what the code says, and its examples run."""

import dataclasses
import pathlib
import re
import runpy

import pytest
import typer.main

import brdfcore as bc
from brdfcore.cli import app
from service.app import create_app
from service.settings import Settings

ROOT = pathlib.Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def section(title: str) -> str:
    return README.split(f"\n## {title}\n")[1].split("\n## ")[0]


def table(text: str) -> dict[str, str]:
    """The first two columns of the table's rows."""
    return dict(re.findall(r"^\| `?([^|`]+?)`? \| (.+?) \|$", text, re.MULTILINE)[1:])


def test_models_are_the_registry() -> None:
    rows = table(section("Models"))
    facts = {name: model.describe() for name, model in bc.MODELS.items()}
    assert rows == {name: f"{told['good_for']} | {told['summary']}" for name, told in facts.items()}


def test_formats_are_the_registry() -> None:
    assert table(section("Measured data")) == {name: format_.description for name, format_ in bc.FORMATS.items()}


def test_exports_are_the_registry() -> None:
    rows = {name: exporter.description for name, exporter in bc.EXPORTS.items()}
    assert table(section("Export")) == rows


def test_losses_are_the_registry() -> None:
    assert list(table(section("Losses"))) == list(bc.LOSSES)


def test_every_command_is_shown() -> None:
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    assert all(f"\nbrdf {name} " in section("Command line") for name in commands)


def test_every_route_is_listed(tmp_path: pathlib.Path) -> None:
    listed = re.sub(r"`\.\.\./(\w+\.png)`", r"`GET /v1/fits/{fit_id}/plots/\1`", section("HTTP"))
    paths = create_app(Settings(data=tmp_path)).openapi()["paths"]
    missing = [f"{m.upper()} {p}" for p, ms in paths.items() for m in ms if f"`{m.upper()} {p}`" not in listed]
    assert not missing


def test_every_setting_is_listed() -> None:
    for setting in dataclasses.fields(Settings):
        assert f"`BRDF_{setting.name.upper()}`" in section("HTTP")


@pytest.mark.parametrize(
    "title", ["Python", "Which model, and where to measure next", "Bounds and sampling", "Energy", "Export", "Scenes"]
)
def test_python_examples_print_what_the_readme_shows(
    title: str, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code, shown = re.findall(r"```(?:python|text)\n(.*?)```", section(title), re.DOTALL)
    (tmp_path / "example.py").write_text(code)
    (tmp_path / "brdfcore").symlink_to(ROOT / "brdfcore")
    monkeypatch.chdir(tmp_path)
    runpy.run_path("example.py")
    assert (tmp_path / "lobes.svg").exists() == ("lobes.svg" in code)
    printed = capsys.readouterr().out
    numbers = re.compile(r"-?\d+\.\d+(?:e-?\d+)?")
    assert numbers.sub("#", printed) == numbers.sub("#", shown)
    assert [float(x) for x in numbers.findall(printed)] == pytest.approx(
        [float(x) for x in numbers.findall(shown)], rel=1e-6
    )


def test_demonstration_prints_what_the_readme_shows() -> None:
    """The report's numbers, from the library, stand in the README as they are."""
    from brdfcore.demo import DATA, MODEL

    for line in bc.fit(bc.read(DATA), MODEL).report().splitlines()[:9]:
        assert line in README
