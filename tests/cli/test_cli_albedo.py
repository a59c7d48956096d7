"""`brdf albedo` as it is typed."""

import json
import pathlib
import sys
from collections.abc import Callable

import pytest
import torch

import brdfcore as bc
from brdfcore.cli import main

Run = Callable[..., tuple[int, str, str]]
DIFFUSE = "lambert(kd=[0.5, 0.25]) + oren_nayar(kd=0.25, sigma=0.5)"


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path) -> Run:
    """Runs the command in this process, in an empty folder that is also the user's cache."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))

    def typed(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["brdf", "albedo", *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
        return int(ended.value.code or 0), *capsys.readouterr()

    return typed


def test_it_prints_each_angle_with_its_error_and_what_it_cost(run: Run) -> None:
    code, out, error = run(DIFFUSE, "--theta-deg", "0, 60,89.9")
    assert (code, error) == (0, "")
    lines = [line.split() for line in out.splitlines()]
    assert out.startswith(DIFFUSE.replace("oren_nayar(", "oren_nayar(qualitative, "))
    assert ["theta", "[degrees]", "albedo", "0", "albedo", "1", "claimed", "error"] in lines
    theta = torch.deg2rad(torch.tensor([0, 60, 89.9], dtype=torch.float64))
    with torch.no_grad():
        own = bc.albedo(bc.material(DIFFUSE), theta).values
    rows = [line for line in lines if line and line[0] in ("0", "60", "89.9")]
    for row, values in zip(rows, own.tolist(), strict=True):
        assert row[1:3] == [f"{value:.7f}" for value in values]
        assert 0 <= float(row[3]) <= 1e-6
    assert "tolerance 1e-06 met, " in lines[-1][0] + " " + " ".join(lines[-1])
    assert lines[-1][-1] == "s"
    assert "more light than it gets" not in out


def test_it_says_where_the_albedo_exceeds_one_and_which_azimuth_it_is(run: Run) -> None:
    code, out, _ = run(
        "lambert(kd=0.6) + ward_bounded(rs=0.9, ax=0.3, ay=0.5)", "--theta-deg=0", "--phi-deg=30", "--tolerance=0.01"
    )
    assert code == 0
    assert "It gives back more light than it gets where the albedo exceeds 1." in out
    assert "azimuth 30 degrees, " in out
    assert "tolerance 0.01 met" in out


def test_no_digit_is_cut_off_where_the_screen_is_narrow(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    _, out, _ = run("lambert(kd=[0.5, 0.25, 0.125])", "--theta-deg=0,60", "--tolerance=1e-10")
    assert "…" not in out
    assert "theta [degrees]" in out
    rows = [line.split() for line in out.splitlines() if line.split()[:1] in (["0"], ["60"])]
    assert [row[1:4] for row in rows] == [["0.50000000000", "0.25000000000", "0.12500000000"]] * 2


def test_json_is_the_librarys_result(run: Run) -> None:
    _, out, _ = run(DIFFUSE, "--theta-deg", "30", "--phi-deg", "10", "--tolerance", "1e-4", "--json")
    found = json.loads(out)
    with torch.no_grad():
        own = bc.albedo(bc.material(DIFFUSE), torch.deg2rad(torch.tensor([30.0], dtype=torch.float64)), 0.17, 1e-4)
    assert found["values"] == [pytest.approx(own.values[0].tolist(), rel=1e-12)]
    assert (found["theta_deg"], found["phi_deg"], found["tolerance"], found["met"]) == ([30.0], 10.0, 1e-4, True)


def test_a_table_is_written_and_described(run: Run, tmp_path: pathlib.Path) -> None:
    axes = ["--axis", "oren_nayar.sigma=0.1:0.9", "--axis", "lambert.kd", "--axis", "theta_deg=0:80"]
    code, out, _ = run("lambert + oren_nayar", "--table", "table.npz", *axes, "--tolerance", "1e-3")
    assert code == 0
    table = bc.AlbedoTable.load(tmp_path / "table.npz")
    assert [axis.name for axis in table.axes] == ["theta", "oren_nayar.sigma", "lambert.kd"]
    rows = {line.split()[0]: line.split()[1:] for line in out.splitlines() if line.strip()}
    assert rows["theta_deg"] == ["0", "80", str(table.values.shape[0])]
    assert rows["oren_nayar.sigma"] == ["0.1", "0.9", str(table.values.shape[1])]
    assert rows["lambert.kd"] == ["0", "1", "2"]
    assert f"error {table.error:.1e} with interpolation, tolerance 0.001 met" in out
    assert f"hash {table.hash[:12]}" in out
    assert (tmp_path / "cache" / "brdfcore" / "albedo" / f"{table.hash}.npz").is_file()
    facts = json.loads(run("lambert + oren_nayar", "--table", "table.json", "--json", *axes, "--tolerance", "1e-3")[1])
    assert (facts["hash"], facts["met"]) == (table.hash, True)
    assert "values" not in facts
    assert bc.AlbedoTable.load(tmp_path / "table.json").hash == table.hash


def test_a_plot_is_written(run: Run, tmp_path: pathlib.Path) -> None:
    code, out, error = run("lambert", "--plot", "albedo.svg", "--json")
    assert (code, error) == (0, "Albedo plot: albedo.svg\n")
    assert json.loads(out)["met"]
    assert "<svg" in (tmp_path / "albedo.svg").read_text()


MISTAKES = {
    "unknown model": (("lambrt",), "Did you mean 'lambert'"),
    "angles": (("lambert", "--theta-deg", "0;30"), "--theta-deg to be numbers separated by commas, got '0;30'"),
    "the horizon": (("lambert", "--theta-deg", "90"), "--theta-deg to be angles in [0, 90), got 90"),
    "no azimuth": (("lambert", "--phi-deg", "nan"), "--phi-deg to be a finite angle, got nan. Give the azimuth in deg"),
    "axis twice": (("lambert", "--table", "t.npz", "--axis", "lambert.kd", "--axis", "lambert.kd"), "lambert.kd twice"),
    "axis without a table": (("lambert", "--axis", "lambert.kd"), "--axis to go with --table"),
    "axis without a range": (("lambert", "--table", "t.npz", "--axis", "lambert.kd=1"), "KEY=LOW:HIGH or KEY"),
    "axis in radians": (("lambert", "--table", "t.npz", "--axis", "theta=0:1"), "named theta_deg"),
    "angles of an axis": (("lambert", "--table", "t.npz", "--axis", "theta_deg=0:91"), "within [0, 90], got (0, 91)"),
    "unknown axis": (("lambert", "--table", "t.npz", "--axis", "kurt.m"), "an axis to be a known name"),
    "angles of a table": (("lambert", "--table", "t.npz", "--theta-deg", "0,60"), "--theta-deg to go without --table"),
    "azimuth of a table": (("lambert", "--table", "t.npz", "--phi-deg", "0"), "--phi-deg to go without --table"),
    "table suffix": (("lambert", "--table", "t.csv"), ".npz or .json"),
    "table folder": (("lambert", "--table", "nosuch/t.npz"), "the table's folder to exist"),
    "plot suffix": (("lambert", "--plot", "x.pdf"), ".svg or .png"),
    "tolerance of a table": (("lambert", "--table", "t.npz", "--tolerance", "2"), "tolerance to be within"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_is_one_sentence(run: Run, case: str) -> None:
    arguments, part = MISTAKES[case]
    code, _, error = run(*arguments)
    assert code == 2
    assert error.startswith("brdf: Expected ")
    assert part in error
    assert error.count("\n") == 1
