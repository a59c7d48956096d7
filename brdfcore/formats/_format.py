"""What a measured-data format is: a name, a test of a file's first bytes, and a reader."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from .samples import Samples


@dataclass(frozen=True)
class Format:
    """One measured-data format.

    name         what `read(format=...)` takes
    description  one line: what the file looks like, and what it leaves to be declared
    sniff        whether a file's first 64 KiB are of this format; never true for another format's files
    read         the samples of (path, quantity, angle_unit); the last two are None where the caller declared nothing
    """

    name: str
    description: str
    sniff: Callable[[bytes], bool]
    read: Callable[[Path, str | None, str | None], Samples]
