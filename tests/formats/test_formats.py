"""The registry of formats: detection by content, and that every format's file is listed."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import brdfcore.formats
from brdfcore.errors import FormatError, UnknownNameError
from brdfcore.formats import FORMATS, Samples, cornell, detect, read

Write = Callable[[str | bytes], Path]

NOT_FORMATS = ("samples",)  # public modules that are no format


def test_every_file_is_in_the_registry() -> None:
    folder = Path(brdfcore.formats.__file__).parent
    files = {path.stem for path in folder.glob("[!_]*.py")} - set(NOT_FORMATS)
    assert files == {FORMATS[name].read.__module__.rpartition(".")[2] for name in FORMATS}
    assert list(FORMATS) == [format_.name for format_ in FORMATS.values()]
    assert all(format_.description for format_ in FORMATS.values())


def test_every_format_has_an_example(examples: dict[str, bytes]) -> None:
    assert set(examples) == set(FORMATS)


@pytest.mark.parametrize("name", FORMATS)
def test_a_file_is_claimed_by_its_own_format_alone(name: str, examples: dict[str, bytes], write: Write) -> None:
    head = examples[name]
    assert [other for other, format_ in FORMATS.items() if format_.sniff(head)] == [name]
    path = write(head)
    samples = read(path)
    assert isinstance(samples, Samples)
    assert samples.format == name
    assert samples.source == path.name
    assert read(str(path), format=name).hash == samples.hash


PNG = b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR\x00\x00\x00\x10\x00\x00\x00\x10\x08\x06\x00\x00\x00"


@pytest.mark.parametrize(
    "content",
    [
        PNG,
        b"PK\x03\x04" + bytes(22) + b"\x10\x00\x00\x00xl/workbook.xml.",
        b"The quick brown fox jumps over the lazy dog.\n",
        b"x,y,z\n1,2,3\n",
        b"1 2 3\n4 5 6\n",
        b"# only a comment\n",
        b"\xff\xfet\x00h\x00e\x00t\x00a\x00_\x00i\x00",
        b"\0",
        b'{"theta_i": [1]}',
        np.random.default_rng(1).bytes(70_000),
    ],
)
def test_anything_else_is_refused_with_the_known_formats(content: bytes, write: Write) -> None:
    with pytest.raises(FormatError, match="Expected the file to be of a known format, got none of them") as caught:
        read(write(content))
    assert caught.value.field == "format"
    assert all(f"{name} (" in str(caught.value) for name in FORMATS)


def test_a_file_that_two_formats_claim_is_left_to_the_caller(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(FORMATS, "twin", cornell.FORMAT)
    with pytest.raises(FormatError, match=r"to be of one format, got cornell and twin\. Pass format\."):
        detect(b"2 400 500\n")


def test_insisting_on_a_format_gives_its_own_complaint(examples: dict[str, bytes], write: Write) -> None:
    with pytest.raises(FormatError, match="start with the dimensions"):
        read(write(examples["csv"]), format="merl")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            {"format": "cvs"},
            "format to be a known name, got 'cvs'. Did you mean 'csv'? Known: csv, cornell, merl, npz",
        ),
        ({"quantity": "btdf"}, "quantity to be a known name, got 'btdf'."),
        ({"angle_unit": "turns"}, "angle_unit to be a known name, got 'turns'."),
    ],
)
def test_unknown_arguments_list_the_known(arguments: dict[str, str], words: str, tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError) as caught:
        read(tmp_path / "any", **arguments)
    assert words in str(caught.value)
    assert caught.value.field == next(iter(arguments))


def test_files_that_cannot_be_read(tmp_path: Path, write: Write) -> None:
    with pytest.raises(FormatError, match=r"Expected measured\.dat to hold measurements, got an empty file\."):
        read(write(b""))
    with pytest.raises(
        FormatError, match=r"a readable file, got 'missing\.csv' \(No such file or directory\)"
    ) as caught:
        read(tmp_path / "missing.csv")
    assert caught.value.field == "path"
    with pytest.raises(FormatError, match=r"\(Is a directory\)"):
        read(tmp_path)
