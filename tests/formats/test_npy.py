"""NumPy arrays with named fields."""

import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from format_cases import named_columns, npy_bytes

from brdfcore.errors import FormatError, SamplesError
from brdfcore.formats import Samples, _size, read

Write = Callable[[bytes], Path]


def saved(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def table(**changes: np.ndarray | None) -> np.ndarray:
    columns = {name: column for name, column in {**named_columns(), **changes}.items() if column is not None}
    made = np.empty(3, dtype=[(name, column.dtype) for name, column in columns.items()])
    for name, column in columns.items():
        made[name] = column
    return made


def test_fields_are_columns(write: Write) -> None:
    samples = read(write(npy_bytes()), quantity="brdf")
    columns = named_columns()
    assert samples.hash == Samples.from_angles(*columns.values(), "degrees").hash
    assert samples.format == "npy"


def test_vectors_and_integers(write: Write) -> None:
    dtype = [(name, "<i2") for name in ("wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z", "value", "weight")]
    samples = read(write(saved(np.array([(0, 0, 1, 0, 0, 1, 2, 3)], dtype=dtype))), quantity="reflectance_factor")
    assert samples.values.item() == pytest.approx(2 / np.pi)
    assert samples.weight is not None


def test_declarations_are_arguments(write: Write) -> None:
    with pytest.raises(FormatError, match=r"quantity to be declared .* the file has no place for it\."):
        read(write(npy_bytes()))
    renamed = table().astype([(name.removesuffix("_deg"), "f8") for name in named_columns()])
    with pytest.raises(FormatError, match="angle_unit to be declared"):
        read(write(saved(renamed)), quantity="brdf")
    assert len(read(write(saved(renamed)), quantity="brdf", angle_unit="degrees")) == 3


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (saved(np.ones((3, 7))), "a table with named fields, got float64 of shape (3, 7). Save"),
        (saved(table()[:0]), "of shape (0,)"),
        (saved(table(value=np.array([1, np.inf, 3]))), "value to be finite, got inf at row 1 (counted from 0)"),
        (saved(table(value=np.array(["a", "b", "c"]))), "value to be a field of real numbers, got <U1"),
        (saved(table(value=np.array([1j, 1, 1]))), "value to be a field of real numbers, got complex128"),
        (saved(table(phi_i_deg=None)), "the header to name theta_i, phi_i, theta_o, phi_o"),
        (saved(table(extra=np.ones(3))), "a known name, got 'extra'"),
        (npy_bytes()[:-4], "to hold 108 bytes as its header says (3 rows of 36), got 104"),
        (npy_bytes().replace(b"(3,)", b"(9,)"), "to hold 324 bytes as its header says (9 rows of 36), got 108"),
        (npy_bytes()[:20], "a readable NumPy array, got ValueError"),
        (b"\x93NUMPY\x02\x00\xff\xff\xff\xff{}", "a header of at most 65,535 bytes, got 4,294,967,295"),
        (b"\x93NUMPY\x09\x00", "a readable NumPy array, got ValueError"),
        (saved(np.array([None, 1])), "a table with named fields, got object"),
    ],
)
def test_damaged_and_other_arrays_are_refused(content: bytes, words: str, write: Write) -> None:
    with pytest.raises((FormatError, SamplesError)) as caught:
        read(write(content), format="npy", quantity="brdf")
    assert words in str(caught.value)


def test_small_types_count_as_the_numbers_that_they_become(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_size, "MOST_NUMBERS", 14)
    with pytest.raises(FormatError, match=r"a file of at most 14 numbers, got 15\. Split it"):
        read(write(npy_bytes()), quantity="brdf")
