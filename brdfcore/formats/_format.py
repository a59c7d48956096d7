"""What a measured-data format is: a name, a test of a file's first bytes, a reader and, for some, a writer."""

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
    read         the samples of (path, quantity, angle_unit), which are None where the caller declared nothing, and of
                 the keywords that `options` names
    options      which of `read`'s further keywords the reader takes: columns, material
    suffix       of the files that `write` writes, such as ".csv"; none where there is no writer
    write        writes samples to a path, to be read back as they are; FormatError for what would not
    """

    name: str
    description: str
    sniff: Callable[[bytes], bool]
    read: Callable[..., Samples]
    options: tuple[str, ...] = ()
    suffix: str | None = None
    write: Callable[[Samples, Path], None] | None = None
