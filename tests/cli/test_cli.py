"""The command line as it is typed."""

import json
import pathlib
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import pytest

import brdfcore as bc
from brdfcore.cli import main
from brdfcore.cli.serve import background
from brdfcore.demo import DATA, MODEL
from service.keys import hashes
from service.settings import Settings

BRDF = pathlib.Path(sys.executable).with_name("brdf")


@dataclass
class Done:
    returncode: int
    stdout: str
    stderr: str


Run = Callable[..., Done]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path) -> Run:
    """Runs a command in this process, in an empty folder, on a terminal of 160 columns."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")

    def typed(*arguments: str | pathlib.Path) -> Done:
        monkeypatch.setattr(sys, "argv", ["brdf", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        return Done(int(ended.value.code or 0), *capsys.readouterr())

    return typed


def test_fit_prints_the_report_and_writes_the_plot(run: Run, tmp_path: pathlib.Path) -> None:
    done = run("fit", DATA, "--model", MODEL, "--plot", "lobes.svg", "--residuals", "residuals.png")
    assert done.returncode == 0, done.stderr
    assert "ward_bounded.rs" in done.stdout
    assert "95 % interval" in done.stdout
    assert "Lobe plot: lobes.svg" in done.stdout
    assert (tmp_path / "lobes.svg").read_text().lstrip().startswith("<?xml")
    assert "Residuals: residuals.png" in done.stdout
    assert (tmp_path / "residuals.png").read_bytes().startswith(b"\x89PNG")


def test_fit_json_is_the_librarys_result(run: Run) -> None:
    done = run("fit", DATA, "--model", MODEL, "--json", "--seed", "3")
    theirs, ours = json.loads(done.stdout), bc.fit(bc.read(DATA), MODEL, seed=3).to_dict()
    for name in ("parameters", "intervals", "standard_errors", "errors", "objective", "provenance", "material"):
        assert theirs[name] == ours[name]


def test_fit_passes_its_options_on(run: Run, tmp_path: pathlib.Path) -> None:
    rows = "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z,r,g,b\n" + "".join(
        f"0,0,1,{x},0,{(1 - x * x) ** 0.5:.12f},{0.1 + x},{0.2 + x},{0.3 + x}\n" for x in (0.0, 0.2, 0.4, 0.6)
    )
    file = tmp_path / "rows.csv"
    file.write_text(rows)
    options = [
        "--quantity",
        "reflectance_factor",
        "--fixed",
        "kurt.f0=0.2",
        "--fixed",
        "kurt.alpha=0",
        "--gray",
        "kurt.ks",
    ]
    done = run("fit", file, "--model", "lambert + kurt(isotropic)", "--loss", "log", "--json", *options)
    result = json.loads(done.stdout)
    assert result["parameters"]["kurt.f0"] == 0.2
    assert result["loss"] == "log"
    assert not isinstance(result["parameters"]["kurt.ks"], list)
    assert len(result["parameters"]["lambert.kd"]) == 3
    assert result["data"]["quantity"] == "reflectance_factor"
    options = ["--quantity", "brdf", "--bounds", "ward_bounded.a=0.2:0.3", "--robust", "cauchy", "--robust-scale", "2"]
    options += ["--max-theta-deg", "30", "--conserve-energy"]
    result = json.loads(run("fit", file, "--model", "lambert + ward_bounded", "--json", *options).stdout)
    assert 0.2 <= float(bc.Material.from_json(result["material"]).values()["ward_bounded.a"].detach()) <= 0.3
    assert result["data"]["masked"][-1]["count"] == 1
    assert result["conservation"] is not None


def test_fit_by_a_service_is_the_same(run: Run, tmp_path: pathlib.Path) -> None:
    key = "a-key-of-some-length"
    with background(Settings(data=tmp_path / "data", port=0, workers=1, api_keys=hashes(key))) as url:
        done = run("fit", DATA, "--model", MODEL, "--server", url, "--api-key", key, "--json", "--plot", "far.svg")
        refused = run("fit", DATA, "--model", MODEL, "--server", url)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["parameters"] == bc.fit(bc.read(DATA), MODEL).to_dict()["parameters"]
    assert (tmp_path / "far.svg").read_text().lstrip().startswith("<?xml")
    assert refused.returncode == 2
    assert refused.stderr.startswith("brdf: Expected a known API key.")
    gone = run("fit", DATA, "--model", MODEL, "--server", "http://127.0.0.1:9")  # a port that nobody listens on
    assert "Is it running?" in gone.stderr


def test_fit_says_what_is_foretold_and_what_to_measure(run: Run, tmp_path: pathlib.Path) -> None:
    """Of the material that it was given, and of one that it chose, whose keywords are its own."""
    samples = bc.read(DATA)
    starts = ["--starts", "ward_bounded.a=0.02 ward_bounded.rs=0.1", "--starts", "ward_bounded.a=0.5"]
    done = run("fit", DATA, "--model", MODEL, *starts, "--held-out", "--next", "2", "--json")
    result, held = json.loads(done.stdout), bc.held_out(samples, MODEL)
    assert result["cost"]["starts"] == bc.fit(samples, MODEL).cost.starts + 2
    assert result["held_out"]["error"] == pytest.approx(held.error, rel=1e-6)
    assert len(result["next_directions"]["directions"]) == 2
    rows = "".join(f"{t},0,{o},180,{0.06 + 1e-4 * (o % 7)}\n" for t in range(10, 70, 10) for o in range(0, 70, 5))
    (tmp_path / "matte.csv").write_text("theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n" + rows)
    asked = ["--quantity", "brdf", "--fixed", "ggx.ks=0.2", "--held-out", "--next", "2"]
    done = run("fit", tmp_path / "matte.csv", "--model", "auto", *asked)
    assert done.returncode == 0, done.stderr
    matte = bc.read(tmp_path / "matte.csv", quantity="brdf")
    _, foretold, proposed = done.stdout.strip().split("\n\n")[-3:]
    held = bc.held_out(matte, "lambert")
    assert foretold.splitlines()[1:] == str(held).splitlines()[1:]
    assert foretold.startswith(f"held out: error {held.error:.5g}, and {held.fitted:.5g} where fitted")
    assert [line.split()[0] for line in foretold.splitlines()[2:]] == ["10", "20", "30", "40", "50", "60"]
    assert proposed == str(bc.next_directions(bc.fit(matte, "lambert"), 2))
    assert proposed.splitlines()[-1].split()[0] == "lambert.kd"


def test_a_channel_that_is_not_there_is_refused_before_the_fit(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bc, "fit", lambda *_, **__: pytest.fail("the fit was made"))
    done = run("fit", DATA, "--model", "lambert", "--channel", "nope", "--residuals", "r.svg")
    assert done.stderr.startswith("brdf: Expected a channel to be a known name, got 'nope'.")


MISTAKES = {
    "no file": (("fit", "absent.csv", "--model", "lambert"), "absent.csv"),
    "unknown model": (("fit", DATA, "--model", "lambrt"), "Did you mean 'lambert'"),
    "fixed without a number": (("fit", DATA, "--model", "lambert", "--fixed", "lambert.kd"), "KEY=NUMBER"),
    "bounds without numbers": (("fit", DATA, "--model", "lambert", "--bounds", "lambert.kd=1"), "KEY=LOW:HIGH"),
    "too steep": (("fit", DATA, "--model", "lambert", "--max-theta-deg", "0.1"), "radians (0.1 degrees)"),
    "plot suffix": (("fit", DATA, "--model", "lambert", "--plot", "x.pdf"), ".svg or .png"),
    "residuals suffix": (("fit", DATA, "--model", "lambert", "--residuals", "x.pdf"), ".svg or .png"),
    "plot scale": (("fit", DATA, "--model", "lambert", "--plot", "x.svg", "--scale", "cubic"), "a scale"),
    "plot folder": (("fit", DATA, "--model", "lambert", "--plot", "nosuch/x.svg"), "folder to exist"),
    "demo's plot": (("demo", "--plot", "d.pdf"), ".svg or .png"),
    "seed": (("fit", DATA, "--model", "lambert", "--seed", "-1"), "seed"),
    "degrees": (("fit", DATA, "--model", "lambert", "--max-theta-deg", "95"), "in (0, 90] degrees, got 95."),
    "no degrees": (("compare", DATA, "--max-theta-deg", "nan"), "in (0, 90] degrees, got nan."),
    "fixed twice": (
        ("fit", DATA, "--model", "lambert", "--fixed", "lambert.kd=0.1", "--fixed", "lambert.kd=0.2"),
        "--fixed to name lambert.kd once",
    ),
    "bounds twice": (
        ("compare", DATA, "--bounds", "lambert.kd=0.1:0.2", "--bounds", "lambert.kd=0.2:0.3"),
        "--bounds to name lambert.kd once",
    ),
    "starts": (("fit", DATA, "--model", "lambert", "--starts", "0.2"), "--starts to be KEY=NUMBER, got '0.2'"),
    "channels": (("fit", DATA, "--model", "lambert", "--fixed", "lambert.kd=0.1,0.2"), "1 channels as the data has"),
    "no directions": (("fit", DATA, "--model", "lambert", "--next", "0"), "count to be a whole number from 1 on"),
    "next by a service": (
        ("fit", DATA, "--model", "lambert", "--next", "2", "--server", "http://127.0.0.1:9"),
        "Expected --next to go without --server",
    ),
    "data folder": (("serve", "--data", "/dev/null/x"), "/dev/null"),
    "undeclared": (("fit", DATA, "--model", "lambert", "--quantity", "brdf_cos"), "quantity"),
    "models": (("models", "krt"), "Did you mean 'kurt'"),
    "setting": (("serve", "--port", "99999"), "port"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_is_one_sentence_and_no_traceback(run: Run, case: str) -> None:
    arguments, part = MISTAKES[case]
    done = run(*arguments)
    assert done.returncode == 2
    assert done.stderr.startswith("brdf: Expected ")
    assert part in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stderr.count("\n") == 1


def test_models_lists_the_registry(run: Run) -> None:
    listed = run("models").stdout
    assert all(name in listed for name in bc.MODELS)
    one = run("models", "kurt").stdout
    for part in (
        "ks F D / (4 (h.wo) (ci co)^alpha)",
        "Source:",
        "Departure:",
        "shadowing exponent",
        "[0, 1]",
        "schlick",
    ):
        assert part in one
    described = json.loads(run("models", "--json").stdout)
    assert [entry["name"] for entry in described["items"]] == list(bc.MODELS)


def test_help_loads_no_torch() -> None:
    code = (
        "import sys; sys.argv = ['brdf', '--help']\n"
        "from brdfcore.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print('LOADED', sorted({'torch', 'fastapi', 'matplotlib', 'numpy', 'pydantic'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert "LOADED []" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize("command", ["fit", "models", "serve", "demo"])
def test_every_command_has_help(run: Run, command: str) -> None:
    assert f"brdf {command}" in run(command, "--help").stdout


def test_demo_does_the_whole_job(tmp_path: pathlib.Path) -> None:
    done = subprocess.run([BRDF, "demo"], capture_output=True, text=True, cwd=tmp_path, timeout=120)
    assert done.returncode == 0, done.stderr
    plot = tmp_path / "red_linoleum.svg"
    assert f"Lobe plot written to {plot}" in done.stdout
    assert plot.read_text().lstrip().startswith("<?xml")
    for part in ("Service running at http://127.0.0.1:", "ward_bounded.a", "95 % interval", "errors: cosine"):
        assert part in done.stdout


def test_serve_says_where_it_is_and_ends_on_interrupt(tmp_path: pathlib.Path) -> None:
    server = subprocess.Popen(
        [BRDF, "serve", "--port", "0", "--data", tmp_path / "data"], stdout=subprocess.PIPE, text=True
    )
    assert server.stdout is not None
    try:
        first, second = server.stdout.readline(), server.stdout.readline()
        assert first.startswith("Service: http://127.0.0.1:")
        assert str(tmp_path / "data") in second
    finally:
        begun = time.monotonic()
        server.terminate()
        server.wait(10)
        server.stdout.close()
    assert time.monotonic() - begun < 5
