"""`brdf render` as it is typed."""

import json
import pathlib
import sys
from collections.abc import Callable

import pytest

from brdfcore.cli import main
from brdfcore.render import SCENES, Camera, Directional, Dome, Scene, Sphere

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path) -> Run:
    """Runs the command in this process, in a folder with one scene, `ball.json`."""
    view = Camera(position=(4, 0, 0), look_at=(0, 0, 0), width=4, height=4)
    ball = Sphere(center=(0, 0, 0), radius=1, material="lambert(kd=0.5) + ggx(ks=0.1)", name="ball")
    lights = [Dome(radiance=1.0), Directional(direction=(1, 0, 0), irradiance=1.0)]
    scene = Scene(camera=view, objects=[ball], lights=lights)
    (tmp_path / "ball.json").write_text(json.dumps(scene.to_json()))
    monkeypatch.chdir(tmp_path)

    def typed(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["brdf", "render", *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
        return int(ended.value.code or 0), *capsys.readouterr()

    return typed


def test_it_prints_the_plan_and_writes_the_image(run: Run) -> None:
    code, out, error = run("ball.json", "--contours", "lines.svg")
    assert "ball</text>" in pathlib.Path("lines.svg").read_text()
    assert (code, error) == (0, "")
    assert "ball: ggx fresnel" in out
    assert out.splitlines()[-1].startswith("ball.png: ")
    assert out.endswith("nothing sampled\n")
    assert pathlib.Path("ball.png").read_bytes()[:4] == b"\x89PNG"


def test_it_forces_effects_and_prints_json(run: Run) -> None:
    options = ["--off", "albedo look-up", "--off", "ball: ggx", "--on", "shadow rays", "--samples", "8", "--seed", "3"]
    code, out, _ = run("ball.json", "-o", "ball.npy", "--json", "--noise", "1e-9", *options)
    found = json.loads(out)
    effects = {effect["name"]: effect for effect in found["effects"]}
    assert code == 0
    assert not effects["ball: ggx"]["on"]
    assert effects["shadow rays"]["forced"]
    assert effects["sample weights"]["error"] is None
    assert (found["samples"], found["file"], found["met"]) == (8, "ball.npy", False)
    assert pathlib.Path("ball.npy").exists()


def test_it_plans_only_and_lists_scenes(run: Run) -> None:
    code, out, _ = run("ball.json", "--plan", "--tolerance", "0.5")
    assert (code, list(pathlib.Path().glob("*.png"))) == (0, [])
    assert out.splitlines()[-1].endswith("within the tolerance 0.5")
    assert run()[1].split() == list(SCENES)
    assert len(SCENES) >= 12


def test_mistakes_are_one_sentence(run: Run) -> None:
    code, out, error = run("ball.json", "-o", "ball.jpg")
    assert (code, out) == (2, "")
    assert error == "brdf: Expected the image's file to end in .png, .npy, .exr, got 'ball.jpg'. Rename it.\n"
    assert run("ball.json", "--device", "tpu")[2].startswith("brdf: Expected device to be cpu, or cuda where")
    assert run("ball.json", "-o", "none/ball.png")[2].startswith(
        "brdf: Expected the image's folder to exist, got 'none'"
    )
    assert run("ball.json", "--contours", "a.gif")[2].startswith(
        "brdf: Expected the plot's file to end in .svg or .png"
    )
    assert run("bull.json")[2].startswith("brdf: Expected scene to be a readable file, got 'bull.json' (No such file")
    assert "Did you mean 'walter_figure_3'?" in run("walter_figure_4")[2]
    assert run("ball.json", "--seed", "-1")[2].startswith("brdf: Expected seed to be a whole number from 0 to")
    assert run("ball.json", "--bounces", "-1")[2].startswith(
        "brdf: Expected bounces to be a whole number from 0 to 1024"
    )
    assert run("ball.json", "--off", "rain")[2].startswith("brdf: Expected an effect to be a known name, got 'rain'.")
