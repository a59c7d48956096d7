"""Files of every format, and the check that damaged ones end in a sentence."""

from collections.abc import Callable
from pathlib import Path

import pytest
from format_cases import SMALL_MERL, examples_of

from brdfcore.formats import merl


@pytest.fixture
def small_merl(monkeypatch: pytest.MonkeyPatch) -> tuple[int, int, int]:
    """MERL's dimensions, made small for this test."""
    monkeypatch.setattr(merl, "SHAPE", SMALL_MERL)
    return SMALL_MERL


@pytest.fixture
def examples(tmp_path: Path, small_merl: tuple[int, int, int]) -> dict[str, bytes]:
    """The bytes of a small good file of each format, by the format's name; what lies beside one is in the folder."""
    return examples_of(tmp_path)


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str | bytes], Path]:
    """Writes a file's content and returns its path, whose extension says nothing."""

    def write_file(content: str | bytes) -> Path:
        path = tmp_path / "measured.dat"
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return write_file
