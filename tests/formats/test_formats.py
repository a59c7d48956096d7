"""The registry of formats: detection by content, and that every format's file is listed."""

import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from format_cases import ARGUMENTS, CSV

import brdfcore.formats
from brdfcore.errors import FormatError, UnknownNameError
from brdfcore.formats import FORMATS, Samples, cornell, detect, read

Write = Callable[[str | bytes], Path]

NOT_FORMATS = ("info", "samples")  # public modules that are no format


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
    samples = read(path, **ARGUMENTS.get(name, {}))
    assert isinstance(samples, Samples)
    assert samples.format == name
    assert samples.source.startswith(path.name)
    assert read(str(path), format=name, **ARGUMENTS.get(name, {})).hash == samples.hash


@pytest.mark.parametrize("name", [name for name in FORMATS if name not in ("merl", "rgl")])
def test_the_largest_value_is_in_the_mirror_direction(name: str, examples: dict[str, bytes], write: Write) -> None:
    """Every example's brightest sample is a mirror geometry; its other ones are not. Grids have tests of their own."""
    samples = read(write(examples[name]), **ARGUMENTS.get(name, {}))
    mirror = samples.wi * torch.tensor([-1.0, -1.0, 1.0], dtype=torch.float64)
    off = torch.rad2deg((mirror * samples.wo).sum(-1).clamp(-1, 1).acos())
    assert off[samples.values.mean(-1).argmax()] < 1e-3
    assert (off > 5).any()


@pytest.mark.parametrize("name", [name for name, format_ in FORMATS.items() if format_.write is not None])
def test_what_is_written_reads_back(name: str, tmp_path: Path) -> None:
    random = np.random.default_rng(3)
    w = random.normal(size=(2, 50, 3))
    w[..., 2] = np.abs(w[..., 2]) + 0.01
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    values = random.normal(size=(50, 2))
    sigma = random.uniform(0.1, 1, (50, 2))
    samples = Samples(
        w[0], w[1], values, ("450", "633.25"), sigma, weight=np.arange(50.0), cell=np.ones(50), azimuth_observed=False
    )
    write = FORMATS[name].write
    assert write is not None
    path = tmp_path / f"written{FORMATS[name].suffix}"
    write(samples, path)
    again = read(path)
    assert again.format == name
    assert again.azimuth_declared is False
    assert again.channels == samples.channels
    for field in ("values", "sigma", "weight", "cell"):
        assert torch.equal(getattr(again, field), getattr(samples, field)), field
    exact = name != "csv"  # which has angles, in degrees
    for field in ("wi", "wo"):
        torch.testing.assert_close(getattr(again, field), getattr(samples, field), rtol=0, atol=0 if exact else 4e-15)
    assert (again.hash == samples.hash) == exact


def test_a_keyword_that_a_format_does_not_take_is_refused(examples: dict[str, bytes], write: Write) -> None:
    with pytest.raises(FormatError, match=r"material to be left out, as a file of the format csv takes none") as caught:
        read(write(examples["csv"]), material=3)
    assert caught.value.field == "material"
    with pytest.raises(FormatError, match=r"columns to be left out, as a file of the format cornell takes none"):
        read(write(examples["cornell"]), format="cornell", columns="a,b")


def test_numbers_without_a_header_are_pointed_to_columns(write: Write) -> None:
    with pytest.raises(
        FormatError, match=r"got the numbers '1 2 3' at its start\. For a table without .* pass columns\."
    ):
        read(write("# a comment\n1 2 3\n"))


def test_pipes_and_devices_are_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/zero")):
        with pytest.raises(FormatError, match=f"to be a plain file, got a pipe or device, '{path.name}'") as caught:
            read(path, format="csv")
        assert caught.value.field == "path"


def test_a_file_beyond_the_limit_is_refused_unread(write: Write) -> None:
    path = write(CSV)
    os.truncate(path, brdfcore.formats.LARGEST + 1)  # sparse: it takes no space
    with pytest.raises(FormatError, match=r"to be at most 2,147,483,648 bytes long, got 2,147,483,649\. Split it"):
        read(path)


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
    with pytest.raises(FormatError, match=r"Expected the file to be of a known format, got .*\. .*\. Known:") as caught:
        read(write(content))
    assert caught.value.field == "format"
    assert str(caught.value).endswith(f" Known: {', '.join(FORMATS)}.")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (PNG, "got unknown binary data. Check that it is a measurement. Known"),
        (b"# only a comment\n", "got no line of data. Check that it is a measurement. Known"),
        (b"# a\nx,y,z\n1,2,3\n", "got 'x,y,z' at its start. For a table, format='csv' says what its header lacks. K"),
        ("für\tx\n".encode(), r"got 'für\tx' at its start."),
        (b"1 2 3\n", "got the numbers '1 2 3' at its start. For a table without a header row, pass columns. Known"),
        (b"1 " + b"2" * 90, f"got the numbers '1 {'2' * 35}...' at its start."),
    ],
)
def test_what_an_unknown_file_begins_with_comes_first(content: bytes, words: str, write: Write) -> None:
    with pytest.raises(FormatError, match=re.escape(words)):
        read(write(content))


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
            f"format to be a known name, got 'cvs'. Did you mean 'csv'? Known: {', '.join(FORMATS)}.",
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
