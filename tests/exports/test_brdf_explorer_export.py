"""BRDF Explorer files: their layout, and that a GLSL compiler takes them (values: test_terms.py)."""

import re
import shutil
import subprocess

import pytest
from export_cases import CHOICES, glsl_f, material_of

import brdfcore as bc

COMPILER = shutil.which("glslangValidator")


def test_layout():
    made = bc.export(
        bc.material("lambert(kd=[0.3, 0.2, 0.1]) + ward_bounded(rs=0.1, ax=0.001, ay=0.3)"), "brdf_explorer"
    )
    lines = made.content.splitlines()
    assert lines[0] == "analytic"
    between = made.content.split("::begin parameters\n")[1].split("\n::end parameters")[0].splitlines()
    assert [line.split()[:2] for line in between] == [
        ["color", "lambert_kd"],
        ["float", "ward_bounded_rs"],
        ["float", "ward_bounded_ax"],
        ["float", "ward_bounded_ay"],
    ]
    numbers = [[float(n) for n in line.split()[2:]] for line in between]
    assert numbers[0] == [0.3, 0.2, 0.1]
    assert numbers[2] == pytest.approx([0.001, 1.5, 0.001], rel=1e-14)  # the slider reaches to the value
    assert numbers[3] == pytest.approx([0.005, 1.5, 0.3], rel=1e-14)
    assert "vec3 BRDF(vec3 L, vec3 V, vec3 N, vec3 X, vec3 Y) {" in made.content
    assert lines[-1] == "::end shader"
    assert glsl_f(made.content, [0.6, 0.0, -0.8], [0.0, 0.6, 0.8]) == (0, 0, 0)


@pytest.mark.skipif(COMPILER is None, reason="needs a GLSL compiler: glslangValidator")
def test_every_model_compiles(tmp_path, unmeasured):
    """In one run of the compiler."""
    kinds = {"color": "vec3", "float": "float"}
    paths = []
    for number, parameter in enumerate(CHOICES):
        text = bc.export(material_of(parameter.values[0], coloured=number % 2 == 0), "brdf_explorer").content
        parameters = re.search(r"::begin parameters\n(.*)\n::end parameters", text, re.DOTALL)[1]
        uniforms = [f"uniform {kinds[line.split()[0]]} {line.split()[1]};" for line in parameters.splitlines()]
        code = re.search(r"::begin shader\n(.*)::end shader", text, re.DOTALL)[1]
        main = "void main() { result = vec4(BRDF(place, place, place, place, place), 1.0); }"
        paths.append(tmp_path / f"shader{number}.frag")
        paths[-1].write_text("\n".join(["#version 330", "in vec3 place; out vec4 result;", *uniforms, code, main]))
    run = subprocess.run([COMPILER, *paths], capture_output=True, text=True, check=False, timeout=60)
    assert run.returncode == 0, run.stdout
