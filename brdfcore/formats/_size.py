"""How many numbers a file may hold, whatever type it stores them in: read, each takes eight bytes."""

from ..errors import FormatError

MOST_NUMBERS = 2**28  # 2 GiB as float64


def check_numbers(count: int) -> None:
    """Raise FormatError where a file, or what unpacks from it, is of more numbers than the limit."""
    if count > MOST_NUMBERS:
        raise FormatError(
            f"Expected a file of at most {MOST_NUMBERS:,} numbers, got {count:,}. Split it, or keep fewer samples."
        )
