"""Text files: encodings, line ends, numbers."""

from collections.abc import Callable
from pathlib import Path

import pytest

from brdfcore.errors import FormatError
from brdfcore.formats._text import brief, brief_list, head_text, number, text_of


@pytest.mark.parametrize("content", [b"a\nb\n", b"a\r\nb\r\n", b"a\rb\r", b"\xef\xbb\xbfa\nb\n"])
def test_line_ends_and_byte_order_mark(content: bytes, write: Callable[[bytes], Path]) -> None:
    assert text_of(write(content)) == "a\nb\n"
    assert head_text(content) == "a\nb\n"


def test_bad_utf8_names_the_byte_and_the_line(write: Callable[[bytes], Path]) -> None:
    with pytest.raises(FormatError, match=r"UTF-8 text, got the byte 0xb0 at line 2\. Save the file as UTF-8\."):
        text_of(write("a\n45°\n".encode("latin-1")))


def test_binary_is_no_text() -> None:
    assert head_text(b"theta_i\0") is None


@pytest.mark.parametrize(
    ("text", "value"),
    [("1", 1.0), ("-1.5", -1.5), ("+.5e-3", 5e-4), ("2.", 2.0), ("1E5", 1e5), ("0", 0.0)],
)
def test_numbers(text: str, value: float) -> None:
    assert number(text) == value


@pytest.mark.parametrize(
    "text",
    ["", "nan", "NaN", "inf", "-Infinity", "1e999", "1_000", "1,5", "0x10", "one", "\N{FULLWIDTH DIGIT ONE}", "."],
)
def test_no_numbers(text: str) -> None:
    assert number(text) is None


def test_quotes_and_lists_are_cut_where_a_damaged_file_makes_them_long() -> None:
    assert brief("a'b") == '"a\'b"'
    assert brief("x" * 40) == repr("x" * 40)
    assert brief("x" * 100_000) == repr("x" * 37 + "...")
    assert brief_list(["a", "b"]) == "a, b"
    assert len(brief_list("name" for _ in range(1000))) == 200
