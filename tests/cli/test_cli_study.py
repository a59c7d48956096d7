"""`brdf study` as it is typed."""

import functools
import json
import pathlib
import sys

import pytest

from brdfcore.cli import app, main
from brdfcore.cli.study import _NAMES
from brdfcore.study import STUDIES


@pytest.fixture
def typed(monkeypatch, capsys, tmp_path):
    """Runs `brdf study` in this process, in an empty folder, with a study of effects that is small."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")
    small = functools.partial(STUDIES["effects"], count=64, repeats=1)
    monkeypatch.setitem(STUDIES, "effects", small)

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["brdf", "study", *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
        return int(ended.value.code or 0), *capsys.readouterr()

    return run


def test_prints_the_table_and_the_sentence_and_writes_the_files(typed, tmp_path) -> None:
    code, out, _ = typed("effects")
    assert code == 0
    assert "RMS relative error [1]" in out
    assert "Leave" in out
    assert "effects: effects.txt, effects.json, effects.svg in brdf-study" in out
    folder = tmp_path / "brdf-study"
    assert sorted(path.name for path in folder.iterdir()) == ["effects.json", "effects.svg", "effects.txt"]
    assert json.loads((folder / "effects.json").read_text())["provenance"]["quick"] is False


def test_json_is_what_is_written(typed, tmp_path) -> None:
    code, out, err = typed("effects", "--json", "--quick", "--seed", "3", "--output", "there")
    assert code == 0
    found = json.loads(out)
    assert list(found) == ["effects"]
    assert found["effects"] == json.loads((tmp_path / "there" / "effects.json").read_text())
    assert found["effects"]["provenance"]["seed"] == 3
    assert found["effects"]["provenance"]["quick"] is True
    assert "effects.svg in there" in err


MISTAKES = {
    "name": (("efects",), "Did you mean 'effects'"),
    "seed": (("effects", "--seed", "-1"), "seed"),
    "folder": (("effects", "--output", "/dev/null/x"), "/dev/null"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_is_one_sentence_and_no_traceback(typed, case: str, tmp_path: pathlib.Path) -> None:
    arguments, part = MISTAKES[case]
    code, out, err = typed(*arguments)
    assert code == 2
    assert err.startswith("brdf: Expected ")
    assert part in err
    assert err.count("\n") == 1
    assert not out
    assert not list(tmp_path.iterdir()), "nothing is written"


def test_the_help_names_every_study(typed) -> None:
    code, out, _ = typed("--help")
    assert code == 0
    assert "--quick" in out
    assert all(name in _NAMES for name in STUDIES)
    assert any(command.name == "study" for command in app.registered_commands)
