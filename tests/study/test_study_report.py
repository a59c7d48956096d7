"""A study as text, JSON and files; the registry; what made it."""

import dataclasses
import json
import math
import pathlib
import time
import xml.etree.ElementTree as ElementTree

import pytest
import torch

import brdfcore.study as studies
from brdfcore.errors import InvalidValueError, UnknownNameError
from brdfcore.plots._panels import Curve, Panel
from brdfcore.study import ASKED_FOR, STUDIES, Chart, Study, check, report, run

STUDY = Study(
    name="made",
    question="what a test asks",
    columns=("method", "time [s]", "met"),
    rows=(("fast", 0.001234, True), ("slow", math.inf, None)),
    charts=(
        Chart("made", "A title", (Panel("case", (Curve("fast", (0.1, 0.2), (1e-3, 0.0)),), (("level", 0.01),)),)),
        Chart("made-2", "Plain", (Panel("", (Curve("y", (0.0, 1.0), (2.0, 3.0)),)),), "x [1]", "y [1]", "curves"),
    ),
    sentence="Take fast.",
    notes=("A note.",),
)


def test_text_holds_the_table_the_sentence_and_the_notes() -> None:
    assert report.text(STUDY) == (
        "made: what a test asks\n\n"
        "method  time [s]  met\n"
        "------  --------  ---\n"
        "fast    0.001234  yes\n"
        "slow         inf    -\n\n"
        "Take fast.\n- A note."
    )


def test_json_has_this_schema_and_no_number_that_json_lacks() -> None:
    data = json.loads(json.dumps(report.to_dict(STUDY), allow_nan=False))
    assert list(data) == [
        "study",
        "question",
        "sentence",
        "notes",
        "columns",
        "rows",
        "plots",
        "pictures",
        "provenance",
    ]
    assert data["rows"] == [["fast", 0.001234, True], ["slow", None, None]]
    assert list(data["plots"][0]) == ["name", "title", "kind", "x", "y", "panels"]
    assert data["plots"][0]["panels"] == [
        {
            "title": "case",
            "curves": [{"label": "fast", "x": [0.1, 0.2], "y": [1e-3, 0.0]}],
            "levels": [{"label": "level", "y": 0.01}],
        }
    ]


def test_files_are_written_and_an_earlier_runs_are_replaced(tmp_path: pathlib.Path) -> None:
    folder = tmp_path / "new" / "folder"
    files = report.write(STUDY, folder)
    assert sorted(file.name for file in files) == ["made-2.svg", "made.json", "made.svg", "made.txt"]
    assert all(ElementTree.parse(file).getroot().tag.endswith("svg") for file in files if file.suffix == ".svg")
    before = (folder / "made.svg").read_bytes()
    (folder / "mine.txt").write_text("kept")
    report.write(dataclasses.replace(STUDY, sentence="Take slow."), folder)
    assert (folder / "made.svg").read_bytes() == before, "the same data is the same plot"
    assert "Take slow." in (folder / "made.txt").read_text()
    assert (folder / "mine.txt").read_text() == "kept"


def test_every_study_file_is_in_the_registry() -> None:
    folder = pathlib.Path(studies.__file__).parent
    assert {path.stem for path in folder.glob("[!_]*.py")} - {"report"} == set(STUDIES)


def test_names_are_checked_and_all_but_the_papers_are_the_default() -> None:
    assert check(["effects", "albedo", "effects"]) == ("effects", "albedo")
    assert check([]) == tuple(name for name in STUDIES if name not in ASKED_FOR)
    with pytest.raises(UnknownNameError, match=r"^Expected a study to be a known name, got 'efects'\. Did you mean"):
        check(["efects"])


@pytest.mark.parametrize("seed", [-1, 2**31, 1.5, True])
def test_a_seed_is_a_whole_number(seed: object) -> None:
    with pytest.raises(InvalidValueError, match=r"^Expected seed to be a whole number from 0 to 2\^31 - 1, got "):
        check([], seed)  # type: ignore[arg-type]


def test_a_run_says_what_made_it(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = {}

    def made(quick: bool = False, seed: int = 0) -> Study:
        asked.update(quick=quick, seed=seed, threads=torch.get_num_threads())
        return STUDY

    monkeypatch.setitem(STUDIES, "effects", made)
    torch.set_num_threads(2)
    try:
        provenance = run("effects", quick=True, seed=7).provenance
        assert torch.get_num_threads() == 2, "the caller's threads are given back"
    finally:
        torch.set_num_threads(1)
    assert asked == {"quick": True, "seed": 7, "threads": 1}
    assert set(provenance) == {"machine", "versions", "threads", "seed", "quick", "date", "seconds"}
    assert provenance["machine"]["cpu"]
    assert provenance["machine"]["cores"] >= 1
    assert provenance["versions"]["torch"] == torch.__version__
    assert set(provenance["versions"]) >= {"python", "numpy", "brdfcore", "scipy", "lmfit"}
    assert provenance["date"].endswith("+00:00")
    json.dumps(provenance, allow_nan=False)
    shown = report.text(dataclasses.replace(STUDY, provenance=provenance)).splitlines()[-1]
    assert "1 thread" in shown
    assert "seed 7" in shown


@pytest.mark.full
def test_all_studies_end_within_a_minute_when_quick() -> None:
    """Of one core, which is what they use: what else the machine does is not their time."""
    begun = time.process_time()
    for name in check([]):
        study = run(name, quick=True)
        assert study.provenance["quick"] is True
        assert study.rows
        assert study.sentence.endswith(".")
        report.figure(study.charts[0])
    assert time.process_time() - begun < 60
