"""The rows: NumPy's fast reading and Python's careful one agree, and errors name line and column."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brdfcore.errors import FormatError
from brdfcore.formats import _table
from brdfcore.formats._table import line_of, parse_rows

NAMES = ("a", "b", "c")


CELLS = st.floats(allow_nan=False, allow_infinity=False)


@given(
    st.lists(st.tuples(CELLS, st.none() | CELLS, st.none() | CELLS), min_size=1),
    st.sampled_from([",", ";", "\t"]),
    st.sampled_from(["", " "]),
)
def test_fast_and_careful_reading_agree(rows: list[tuple[float | None, ...]], delimiter: str, blank: str) -> None:
    lines = (delimiter.join(blank if x is None else blank + repr(x) for x in row) for row in rows)
    body = "".join(f"{line} # note\n\n" for line in lines)
    expected = np.array([[math.nan if x is None else x for x in row] for row in rows])
    np.testing.assert_array_equal(_table._parse_slowly(body, 2, delimiter, NAMES), expected)
    np.testing.assert_array_equal(parse_rows(body, 2, delimiter, NAMES), expected)


def test_the_normal_path_leaves_the_rows_to_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_table, "_parse_slowly", None)
    rows = parse_rows("1,2,3\n# a comment\n\n0,5,\n0,,\n4,,6 # note\n", 2, ",", NAMES)
    nan = math.nan
    np.testing.assert_array_equal(rows, [[1, 2, 3], [0, 5, nan], [0, nan, nan], [4, nan, 6]])
    np.testing.assert_array_equal(parse_rows(" 1  2\t3\n", 2, None, NAMES), [[1, 2, 3]])


def test_long_files_are_read_in_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_table, "_CHUNK", 2)
    body = "1,2,3\n# x\n# y\n# z\n4,5,6\n7,8,9\n"
    np.testing.assert_array_equal(parse_rows(body, 2, ",", NAMES), [[1, 2, 3], [4, 5, 6], [7, 8, 9]])
    with pytest.raises(FormatError, match="at line 7"):
        parse_rows(body.replace("9", "nine"), 2, ",", NAMES)


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("1,2,3\n1,nan,3\n", "Expected b at line 6 to be a finite number, got 'nan'. Correct it. A value that was not"),
        ("1,2,-Infinity\n", "c at line 5 to be a finite number, got '-Infinity'"),
        ("1,2,3\n\n# x\n1,2,1e999\n", "c at line 8 to be a finite number, got '1e999'"),
        (",2,nan\n", "c at line 5 to be a finite number, got 'nan'"),
        ("1,2,x\n", "c at line 5 to be a finite number, got 'x'. Correct it."),
        ("1,2,3\n1,2\n", "line 6 to have 3 columns as the header has, got 2. Check the delimiter"),
        ("1,2,3,4\n", "line 5 to have 3 columns as the header has, got 4"),
        ("1,2,3\n1,2,3,\n", "line 6 to have 3 columns as the header has, got 4"),
        ("\n# only comments\n  \n", "at least one row of data after the header, got none"),
        ("", "at least one row of data after the header, got none"),
    ],
)
def test_bad_rows_are_refused_by_line_and_column(body: str, words: str) -> None:
    with pytest.raises(FormatError) as caught:
        parse_rows(body, 5, ",", NAMES)
    assert words in str(caught.value)


def test_a_decimal_comma_is_recognised() -> None:
    with pytest.raises(FormatError, match=r"got '1,5'\. Write a decimal point\.") as caught:
        parse_rows("1;1,5;3\n", 2, ";", NAMES)
    assert caught.value.field == "b"


def test_line_of_skips_what_is_no_data() -> None:
    body = "1,2\n\n# x\n  \n3,4\n"
    assert [line_of(body, 3, row) for row in (0, 1)] == [3, 7]
    with pytest.raises(IndexError):
        line_of(body, 3, 2)
