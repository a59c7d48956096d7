"""`brdf export` as it is typed."""

import json
import sys

import pytest

import brdfcore as bc
from brdfcore.cli import main

TEXT = "lambert(kd=0.3) + ward_bounded(rs=0.1, ax=0.1, ay=0.3)"


@pytest.fixture
def typed(monkeypatch, capsys):
    """Runs `brdf export` in this process."""

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["brdf", "export", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        return int(ended.value.code or 0), *capsys.readouterr()

    return run


def test_a_text_becomes_a_file(typed, tmp_path):
    out = tmp_path / "glossy.rad"
    code, said, _ = typed(TEXT, "--to", "radiance", "--orientation", "0,0,1", out)
    assert code == 0
    assert said.startswith(f"{out}: Radiance material WGMDfunc. Exact: relative RMS difference of f cos theta_i ")
    assert "void 0.0 0.0 1.0 ." in out.read_text()
    assert "void WGMDfunc glossy\n" in out.read_text()


def test_a_fits_json_and_an_exports_json_become_files(typed, tmp_path):
    material = bc.material(TEXT)
    fit = tmp_path / "fit.json"
    fit.write_text(json.dumps({"model": "x", "material": material.to_json()}))
    first, second = tmp_path / "first.json", tmp_path / "second.json"
    assert typed(fit, "--to", "json", first)[0] == 0
    assert typed(first, "--to", "json", second)[0] == 0
    assert first.read_text() == second.read_text() == bc.export(material, "json").content


def test_a_refit_says_how_far_off_it_is(typed, tmp_path):
    code, said, _ = typed("lambert + ggx(a=0.5)", "--to", "radiance", tmp_path / "out.rad")
    assert code == 0
    assert "the nearest that Radiance has. Not exact: relative RMS difference of f cos theta_i 0." in said


def test_mistakes_are_one_sentence(typed, tmp_path):
    bad = tmp_path / "bad.json"
    bad.write_text("{")
    cases = [
        ((TEXT, "--to", "povray", tmp_path / "x"), "Expected format to be a known name, got 'povray'."),
        (
            (TEXT, "--to", "radiance", "--orientation", "up", tmp_path / "x"),
            "--orientation to be three numbers, got 'up'",
        ),
        ((bad, "--to", "json", tmp_path / "x"), "Expected bad.json to be JSON, got"),
        ((TEXT, "--to", "json", tmp_path / "no" / "x"), "Expected to read or write"),
    ]
    for arguments, message in cases:
        code, _, err = typed(*arguments)
        assert code == 2
        assert message in err
