"""The rows of a delimited file as an array of numbers: NumPy reads them, and Python finds what it could not read."""

import io
import re

import numpy as np
import numpy.typing as npt

from ..errors import FormatError
from ._text import brief, number

_NOT_FINITE = re.compile("nan|inf", re.IGNORECASE)
_DATA = re.compile(r"^[ \t]*[^#\s]", re.MULTILINE)
_CHUNK = 65_536  # lines read at once: enough for NumPy's speed, few enough to find a bad cell soon

Array = npt.NDArray[np.float64]


def parse_rows(body: str, first_line: int, delimiter: str | None, names: tuple[str, ...]) -> Array:
    """The rows (N, columns) after a header; an empty cell is NaN, and no other cell is.

    Raises FormatError naming the line (the file's first is 1) and the column.
    """
    lines = body.split("\n")
    chunks = []
    for start in range(0, len(lines), _CHUNK):
        chunk = "\n".join(lines[start : start + _CHUNK]) + "\n"
        if _DATA.search(chunk) is not None:
            rows = _parse_fast(chunk, delimiter, len(names))
            chunks.append(_parse_slowly(chunk, first_line + start, delimiter, names) if rows is None else rows)
    if not chunks:
        raise FormatError("Expected at least one row of data after the header, got none. Check that the file is whole.")
    return np.concatenate(chunks)


def _parse_fast(chunk: str, delimiter: str | None, width: int) -> Array | None:
    """The rows of some lines, or None where something in them needs a closer look."""
    filled = chunk
    if delimiter is not None:
        pair = delimiter * 2
        # twice, as a run of three delimiters holds two overlapping pairs
        filled = filled.replace(pair, f"{delimiter}nan{delimiter}").replace(pair, f"{delimiter}nan{delimiter}")
        filled = filled.replace(f"{delimiter}\n", f"{delimiter}nan\n")
    try:
        rows = np.loadtxt(io.StringIO(filled), delimiter=delimiter, comments="#", ndmin=2)
    except ValueError:  # the rows disagree in length, or a cell is no number (or one of blanks)
        return None
    written = np.isinf(rows).any() or (np.isnan(rows).any() and _NOT_FINITE.search(chunk) is not None)
    return None if rows.shape[1] != width or written else rows


def line_of(body: str, first_line: int, row: int) -> int:
    """The line of the file, counted from 1, that holds a row of data, counted from 0."""
    for line, content in enumerate(body.split("\n"), first_line):
        if content.split("#", 1)[0].strip():
            if row == 0:
                return line
            row -= 1
    raise IndexError(row)


def _parse_slowly(chunk: str, first_line: int, delimiter: str | None, names: tuple[str, ...]) -> Array:
    """The same rows a cell at a time; FormatError names the first cell that is no number."""
    rows: list[list[float]] = []
    for line, content in enumerate(chunk.split("\n"), first_line):
        data = content.split("#", 1)[0]
        if not data.strip():
            continue
        cells = data.split(delimiter)
        if len(cells) != len(names):
            raise FormatError(
                f"Expected line {line} to have {len(names)} columns as the header has, got {len(cells)}. "
                "Check the delimiter, and that the file is whole."
            )
        rows.append([_cell(cell.strip(), line, name) for cell, name in zip(cells, names, strict=True)])
    return np.array(rows, dtype=np.float64)


def _cell(text: str, line: int, name: str) -> float:
    if not text:
        return float("nan")
    value = number(text)
    if value is None:
        hint = "Write a decimal point." if number(text.replace(",", ".")) is not None else "Correct it."
        empty = " A value that was not measured is an empty cell." if _NOT_FINITE.search(text) else ""
        raise FormatError(
            f"Expected {name} at line {line} to be a finite number, got {brief(text)}. {hint}{empty}", field=name
        )
    return value
