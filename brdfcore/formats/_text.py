"""Text files as measured data write them: UTF-8, any line end, `#` comments, plain numbers."""

import math
import re
from collections.abc import Iterable
from pathlib import Path

from ..errors import FormatError

_LONGEST_QUOTE = 40
_LONGEST_LIST = 200

# float() alone would also take "nan", "1_000" and digits of other scripts
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def text_of(path: Path) -> str:
    r"""The file's text with "\n" line ends and no byte order mark."""
    content = path.read_bytes()
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise FormatError(
            f"Expected the file to be UTF-8 text, got the byte 0x{content[error.start]:02x} at line {line}. "
            "Save the file as UTF-8."
        ) from error
    return text.replace("\r\n", "\n").replace("\r", "\n")


def head_text(head: bytes) -> str | None:
    """The first bytes of a file as text, as far as whole lines go; None where they are no text."""
    if b"\0" in head:
        return None
    return head.decode("utf-8-sig", errors="replace").replace("\r\n", "\n").replace("\r", "\n")


def brief(text: str) -> str:
    """The text as an error quotes it, cut where a damaged file makes it long."""
    return repr(text if len(text) <= _LONGEST_QUOTE else text[: _LONGEST_QUOTE - 3] + "...")


def brief_list(names: Iterable[str]) -> str:
    """Some names as an error lists them, cut where a damaged file makes them many."""
    text = ", ".join(names)
    return text if len(text) <= _LONGEST_LIST else text[: _LONGEST_LIST - 3] + "..."


def number(text: str) -> float | None:
    """The finite number that the text spells, or None."""
    if _NUMBER.fullmatch(text) is None:
        return None
    value = float(text)
    return value if math.isfinite(value) else None
