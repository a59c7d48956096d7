"""Files of every format, and the check that damaged ones end in a sentence."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from format_cases import SMALL_MERL, cornell_bytes, csv_bytes, merl_bytes, npz_bytes
from rgl_file import rgl_bytes

from brdfcore.errors import BrdfError
from brdfcore.formats import Samples, merl, read


@pytest.fixture
def small_merl(monkeypatch: pytest.MonkeyPatch) -> tuple[int, int, int]:
    """MERL's dimensions, made small for this test."""
    monkeypatch.setattr(merl, "SHAPE", SMALL_MERL)
    return SMALL_MERL


@pytest.fixture
def examples(tmp_path: Path, small_merl: tuple[int, int, int]) -> dict[str, bytes]:
    """The bytes of a small good file of each format, by the format's name."""
    return {
        "csv": csv_bytes(),
        "cornell": cornell_bytes(),
        "merl": merl_bytes(),
        "npz": npz_bytes(tmp_path),
        "rgl": rgl_bytes(),
    }


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str | bytes], Path]:
    """Writes a file's content and returns its path, whose extension says nothing."""

    def write_file(content: str | bytes) -> Path:
        path = tmp_path / "measured.dat"
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return write_file


@pytest.fixture
def fuzz(write: Callable[[bytes], Path]) -> Callable[[str, bytes, int], int]:
    """Reads damaged versions of a file; each yields Samples or BrdfError. Returns how many were refused."""

    def run(format_name: str, content: bytes, cases: int) -> int:
        random = np.random.default_rng(20100629)
        refused = 0
        for case in range(cases):
            damaged = bytearray(content)
            kind = case % 4
            if kind == 0:
                damaged = damaged[: random.integers(len(content))]
            elif kind == 1:
                for at in random.integers(len(content), size=3):
                    damaged[at] ^= 1 << random.integers(8)
            elif kind == 2:
                at = random.integers(len(content))
                damaged[at : at + 8] = random.bytes(random.integers(1, 16))
            else:
                damaged = bytearray(random.bytes(random.integers(1, 200)))
            path = write(bytes(damaged))
            sentence = ""
            try:
                assert isinstance(read(path, format=format_name), Samples)
            except BrdfError as error:
                sentence = str(error)
                refused += 1
            assert not sentence or (sentence.startswith("Expected ") and sentence.endswith("."))
        return refused

    return run
