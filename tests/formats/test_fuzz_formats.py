"""Damaged files of every format end in a sentence or in samples: no crash, hang, warning, or memory beyond a limit."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import brdfcore
from brdfcore.formats import FORMATS

WORKER = Path(__file__).with_name("fuzz_worker.py")
SLOW = 5.0  # seconds of CPU for one small file, fifty times the slowest met


def run(count: int, names: list[str], folder: Path) -> dict[str, dict[str, object]]:
    """What became of `count` damaged files of each format, in a process whose memory is limited."""
    root = Path(brdfcore.__file__).parent.parent
    done = subprocess.run(
        [sys.executable, "-W", "error", str(WORKER), str(folder), str(count), *names],
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(root), str(root / "tests")]), "OMP_NUM_THREADS": "1"},
    )
    assert done.returncode == 0, f"it ended with {done.returncode}: {done.stderr[-2000:]}"
    return json.loads(done.stdout)


def check(found: dict[str, dict[str, object]], count: int) -> None:
    for name, result in found.items():
        assert result["wrong"] == [], name
        assert result["slowest"] < SLOW, name
        assert result["refused"] > count / 2, name
        assert result["read"] + result["refused"] == count, name


def test_damaged_files_are_read_or_refused(tmp_path: Path) -> None:
    check(run(50, list(FORMATS), tmp_path), 50)


@pytest.mark.full
@pytest.mark.parametrize("name", FORMATS)
def test_ten_thousand_damaged_files(name: str, tmp_path: Path) -> None:
    count = -(-10_000 // len(FORMATS))
    found = run(count, [name], tmp_path)
    check(found, count)
    assert found[name]["read"] > count / 50  # some damage does no harm, else nothing but the sniffers was tried
