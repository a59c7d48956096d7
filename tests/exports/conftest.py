"""Fixtures of the export tests."""

import pytest


@pytest.fixture
def unmeasured(monkeypatch: pytest.MonkeyPatch) -> None:
    """Exports of shaders without the time that their difference takes; test_exports.py tests that."""
    for name in ("brdf_explorer", "mitsuba"):
        monkeypatch.setattr(f"brdfcore.exports.{name}.difference", lambda material, other: 0.0)
