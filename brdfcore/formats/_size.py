"""How many numbers a file may hold, whatever type it stores them in: read, each takes eight bytes."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from ..errors import FormatError

MOST_NUMBERS = 2**28  # 2 GiB as float64
_ALLOWED: ContextVar[float] = ContextVar("_ALLOWED", default=math.inf)


@contextmanager
def at_most(numbers: int) -> Iterator[None]:
    """Files read inside may hold so many numbers, for who reads files of strangers."""
    before = _ALLOWED.set(numbers)
    try:
        yield
    finally:
        _ALLOWED.reset(before)


def check_numbers(count: int) -> None:
    """Raise FormatError where a file, or what unpacks from it, is of more numbers than the limit."""
    most = int(min(MOST_NUMBERS, _ALLOWED.get()))
    if count > most:
        raise FormatError(
            f"Expected a file of at most {most:,} numbers, got {count:,}. Split it, or keep fewer samples."
        )
