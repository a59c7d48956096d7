"""`brdf check MATERIAL` as it is typed; `--hard-cases` has a file of its own."""

import json
import sys

import pytest

import brdfcore as bc
from brdfcore.cli import main
from brdfcore.cli._certificate import ANGLES_DEG, _says


@pytest.fixture
def typed(monkeypatch, capsys):
    """Runs `brdf check` in this process."""

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["brdf", "check", *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
        return int(ended.value.code or 0), *capsys.readouterr()

    return run


def test_the_verdict_comes_first_and_each_term_beside_what_its_text_says(typed) -> None:
    text = "lambert(kd=0.3) + ward_duer(rs=1, a=0.1)"
    code, out, err = typed(text)
    assert (code, err) == (1, "")
    lines = out.splitlines()
    assert lines[0] == str(bc.material(text))
    assert lines[2].startswith("Reflects more than it receives ")
    assert lines[2] == bc.certify(bc.material(text)).verdict
    for part in (
        "largest albedo        no limit, in the limit towards grazing\n",
        "towards grazing       like 1/cos theta\n",
        "reciprocity error     0 of f, over ",
        "smallest f            0.0955 1/sr",
        "theta [degrees]       0       30      60 ",
        "lambert says          Reciprocal; the directional albedo is kd from every direction.\n",
        "found                 Conserves energy: the largest albedo is 0.3, at normal incidence.\n",
        "ward_duer says        Reciprocal.",
        "found                 Reflects more than it receives beyond 85.6 degrees: the albedo grows like 1/cos theta",
    ):
        assert part in out
    assert max(map(len, lines)) <= 120


def test_one_term_is_found_once(typed) -> None:
    code, out, _ = typed("oren_nayar(kd=1, sigma=0.2)")
    assert code == 1
    assert "above 1               first at 7" in out
    assert "\nfound" not in out


def test_albedos_that_are_small_stand_apart(typed) -> None:
    _, out, _ = typed("ward(rs=1e-6, a=0.01)")
    (row,) = (line for line in out.splitlines() if line.startswith("albedo "))
    assert len(row.split()) == 1 + len(ANGLES_DEG)


def test_json_is_the_librarys_certificate(typed) -> None:
    text = "lambert(kd=[0.2, 0.1]) + ashikhmin_shirley_diffuse(kd=[0.1, 0.5], f0=0.5)"
    code, out, _ = typed(text, "--json")
    assert code == 0
    theirs, ours = json.loads(out), bc.certify(bc.material(text)).to_dict()
    assert theirs.pop("material") == str(bc.material(text))
    terms = theirs.pop("terms")
    for found in (theirs, ours):
        del found["seconds"]
    assert theirs == ours
    assert [term["label"] for term in terms] == ["lambert", "ashikhmin_shirley_diffuse"]
    assert [term["certificate"]["channel"] for term in terms] == [0, 1]


def test_a_tie_is_a_value_for_the_term_alone(typed) -> None:
    text = "coupled_lambert(kd=0.5, f0=ashikhmin_shirley.f0) + ashikhmin_shirley(f0=0.6, n=10)"
    _, out, _ = typed(text, "--json")
    alone = bc.certify(bc.material("coupled_lambert(kd=0.5, f0=0.6)"))
    assert json.loads(out)["terms"][0]["certificate"]["max_albedo"] == pytest.approx(alone.max_albedo, abs=1e-9)


def test_a_preset_is_known_by_its_name(typed) -> None:
    code, out, _ = typed("red_linoleum_ward_bounded", "--json")
    assert code == 0
    assert json.loads(out)["material"] == str(bc.material(bc.PRESETS["red_linoleum_ward_bounded"].text))


@pytest.mark.parametrize("model", bc.MODELS.values(), ids=bc.MODELS)
def test_every_model_says_something(model) -> None:
    says = _says(model())
    assert says.startswith("Reciprocal" if model.reciprocal else "Not reciprocal")
    assert "Source" not in says
    assert says.endswith(".")


@pytest.mark.parametrize(("arguments", "part"), [((), "told what to check"), (("lambrt",), "Did you mean 'lambert'")])
def test_a_mistake_is_one_sentence(typed, arguments, part) -> None:
    code, out, err = typed(*arguments)
    assert (code, out) == (2, "")
    assert err.startswith("brdf: Expected ")
    assert part in err


def test_the_help_says_what_the_exit_code_means(typed) -> None:
    assert "exit code 1" in " ".join(typed("--help")[1].split())
