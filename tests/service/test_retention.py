"""What is older than the days that are set goes, with all that belongs to it; what a job still has stays."""

import os
import pathlib
import time
from dataclasses import replace

from starlette.testclient import TestClient

from service import disk
from service.app import create_app
from service.settings import Settings


def test_old_files_that_no_job_mentions_are_removed(tmp_path: pathlib.Path) -> None:
    for name, age in (("gone", 100), ("asked", 100), ("new", 0)):
        path = tmp_path / f"{name}.png"
        path.write_bytes(b"")
        os.utime(path, (time.time() - age, time.time() - age))
    assert disk.forget(tmp_path, time.time() - 50, lambda name: name == "asked") == 1
    assert sorted(path.stem for path in tmp_path.iterdir()) == ["asked", "new"]
    assert disk.forget(tmp_path / "none", time.time(), lambda name: False) == 0


def test_a_service_clears_away_what_is_old(settings: Settings) -> None:
    kept = []
    for folder in ("datasets/" + "0" * 64, "renders", "tables"):
        (settings.data / folder).mkdir(parents=True)
        kept.append(settings.data / folder / "a.npz")
        kept[-1].touch()
        for path in (kept[-1], kept[-1].parent):
            os.utime(path, (0, 0))
    with TestClient(create_app(replace(settings, keep_days=1.0))):
        end = time.monotonic() + 30
        while any(path.exists() for path in kept):
            assert time.monotonic() < end, kept
            time.sleep(0.01)
