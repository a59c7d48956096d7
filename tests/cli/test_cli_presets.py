"""`brdf models` and presets: listed, printed whole, and in JSON as the service lists them."""

import dataclasses
import json

import pytest

import brdfcore as bc
from brdfcore.cli import models
from brdfcore.errors import UnknownNameError

Capture = pytest.CaptureFixture[str]


def test_every_preset_is_in_the_list(capsys: Capture) -> None:
    models.command()
    lines = capsys.readouterr().out.splitlines()
    for preset in bc.PRESETS.values():
        assert any(line.split()[:1] == [preset.name] for line in lines)


@pytest.mark.parametrize("preset", bc.PRESETS.values(), ids=bc.PRESETS)
def test_a_preset_is_printed_whole(preset: bc.Preset, capsys: Capture) -> None:
    models.command(preset.name)
    summary, _, text, _, source = capsys.readouterr().out.splitlines()
    assert (summary, text.strip(), source) == (preset.summary, preset.text, f"Source: {preset.source}.")


def test_json_has_the_presets_beside_the_models(capsys: Capture) -> None:
    models.command(as_json=True)
    described = json.loads(capsys.readouterr().out)
    assert [model["name"] for model in described["items"]] == list(bc.MODELS)
    assert described["presets"] == [dataclasses.asdict(preset) for preset in bc.PRESETS.values()]
    models.command("red_velvet_kurt", as_json=True)
    assert json.loads(capsys.readouterr().out) == dataclasses.asdict(bc.PRESETS["red_velvet_kurt"])


def test_a_name_that_is_neither_lists_both() -> None:
    with pytest.raises(
        UnknownNameError, match=r"^Expected a model or preset to be a known name, .* 'kurt_eq_13'.*beckm"
    ):
        models.command("kurt_eq13")
