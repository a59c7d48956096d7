"""`brdf models`: nothing of what a model says of itself is cut off."""

import pytest

import brdfcore as bc
from brdfcore.cli import models


@pytest.mark.parametrize("name", list(bc.MODELS))
def test_a_model_is_printed_whole(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    models.command(name)
    printed = capsys.readouterr().out
    facts = bc.MODELS[name].describe()
    assert printed.startswith(facts["text"])
    words = " ".join(printed[len(facts["text"]) :].split())
    assert words.startswith(f"Good for: {facts['good_for']} ")
    assert all(word in words for group in facts["options"] for word in group)
    for p in facts["parameters"]:
        assert f" {p['name']} {p['box']} {p['default']:g} {p['per_channel']} " in words
    assert "…" not in printed


def test_a_parameter_is_printed_with_the_words_that_declare_it(capsys: pytest.CaptureFixture[str]) -> None:
    models.command("ggx")
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert "eta [1.0001, 4] 1.5 optional dielectric relative index of refraction [1]" in lines
    assert "eta [0.01, 20] 1 optional conductor real part of the index of refraction [1]" in lines
    assert "ks [0, 1] 0.5 yes always specular reflectance [1]" in lines
    models.command("ashikhmin_shirley")
    assert "scaled or constant" in capsys.readouterr().out


def test_the_list_cuts_no_word_short(capsys: pytest.CaptureFixture[str]) -> None:
    models.command()
    printed = capsys.readouterr().out
    assert "…" not in printed
    for model in bc.MODELS.values():
        assert model.name in printed
        assert all(word in printed for word in model.good_for.split())
        assert all(word in printed for group in model.option_groups for word in group)
