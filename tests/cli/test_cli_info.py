"""`brdf info` and `brdf convert` as they are typed."""

import json
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import brdfcore as bc
from brdfcore.cli import main
from brdfcore.demo import DATA

Run = Callable[..., tuple[int, str, str]]

CSV = """\
# quantity: brdf_cos
theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,450,550,sigma_450,sigma_550,weight
60,0,60,180,1,2,.1,.2,1
30,0,90,180,1,2,.1,.2,1
30,0,20,180,1,2,.1,.2,3
"""
TABLE = "# a comment\n45 0 45 180 12.5\n30 0 10 20 .25\n"
COLUMNS = ("--columns", "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value", "--quantity", "brdf")


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Run:
    """Runs a command in this process, in a folder with measured.csv and table.txt."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "measured.csv").write_text(CSV)
    (tmp_path / "table.txt").write_text(TABLE)

    def typed(*arguments: str | Path) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["brdf", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        return int(ended.value.code or 0), *capsys.readouterr()

    return typed


def test_info_is_the_librarys(run: Run) -> None:
    assert run("info", DATA) == (0, bc.info(bc.read(DATA)).text() + "\n", "")
    code, out, _ = run("info", DATA, "--json")
    assert code == 0
    assert json.loads(out) == json.loads(json.dumps(bc.info(bc.read(DATA)).to_dict()))


def test_info_draws(run: Run) -> None:
    code, out, err = run("info", DATA, "--plot", "directions.svg", "--json")
    assert code == 0
    assert json.loads(out)["samples"] == 222
    assert err == "Plot of the directions: directions.svg\n"
    assert Path("directions.svg").read_text().lstrip().startswith("<?xml")


def test_what_a_file_lacks_is_declared(run: Run) -> None:
    code, out, err = run("info", "table.txt")
    assert (code, out) == (2, "")
    assert "pass columns" in err
    code, out, _ = run("info", "table.txt", *COLUMNS)
    assert code == 0
    assert "samples               2 in 1 channel\n" in out
    code, _, err = run("info", "measured.csv", "--material", "3")
    assert code == 2
    assert "material to be left out" in err


def test_fit_reads_the_same_files(run: Run) -> None:
    code, out, _ = run("fit", "table.txt", *COLUMNS, "--model", "lambert")
    assert code == 0
    assert "lambert.kd" in out


def test_a_service_takes_no_file_of_several_materials(run: Run) -> None:
    code, _, err = run("fit", "x", "--model", "lambert", "--material", "3", "--server", "http://127.0.0.1:1")
    assert code == 2
    assert "Expected --material to go without --server, which takes files of one material, got both." in err


@pytest.mark.parametrize("suffix", [".csv", ".npz", ".parquet", ".arrow"])
def test_convert_keeps_everything(suffix: str, run: Run) -> None:
    if suffix in (".parquet", ".arrow"):
        pytest.importorskip("pyarrow")
    code, out, err = run("convert", "measured.csv", f"out{suffix}")
    assert (code, err) == (0, "")
    assert out == (
        f"out{suffix}: 2 samples of the BRDF [1/sr] in 2 channels, with sigma and weight\n"
        "left out: 1 where a direction is at the horizon, where no BRDF can be measured\n"
    )
    before, after = bc.read("measured.csv"), bc.read(f"out{suffix}")
    assert after.channels == before.channels == ("450", "550")
    assert after.values.tolist() == before.values.tolist()
    assert after.sigma is not None
    assert before.sigma is not None
    assert after.sigma.tolist() == before.sigma.tolist()
    assert after.weight is not None
    assert after.weight.tolist() == [1.0, 3.0]
    assert after.azimuth_observed is before.azimuth_observed is False


def test_a_table_whose_channels_cannot_be_columns_is_sent_to_npz(run: Run) -> None:
    text = "#DIM 6 3\n#PARAM_IN CARTESIAN\n#PARAM_OUT XYZ_COLOR\n0 0 1 0 0 1 .1 .2 .3\n"
    Path("xyz.alta").write_text(text)
    code, _, err = run("convert", "xyz.alta", "out.csv", "--quantity", "brdf")
    assert code == 2
    assert (
        "Expected channels to be value, or r, g, b, or wavelengths in nm for a table, got x, y, z. Write an .npz" in err
    )
    assert not Path("out.csv").exists()
    assert run("convert", "xyz.alta", "out.npz", "--quantity", "brdf")[0] == 0
    assert bc.read("out.npz").channels == ("x", "y", "z")


@pytest.mark.parametrize(
    ("out", "words"),
    [
        ("out.xyz", "Expected OUT to end in .csv, .npz, .parquet, .arrow, got '.xyz'. Rename it."),
        ("out", "got 'no suffix'"),
        ("measured.csv", "Expected OUT to be another file than FILE, got 'measured.csv' for both."),
        ("missing/out.csv", "Expected to read or write missing/out.csv, got: No such file or directory."),
    ],
)
def test_where_nothing_can_be_written_is_one_sentence(out: str, words: str, run: Run) -> None:
    code, printed, err = run("convert", "measured.csv", out)
    assert (code, printed) == (2, "")
    assert words in err
    assert Path("measured.csv").read_text() == CSV
