"""Measured data: the formats that can be read, and the samples that they yield.

A format's file holds one `Format`; listing it in FORMATS is all that the reader, the command line and the service need.
"""

import stat
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Final

from ..errors import FormatError, unknown_name
from . import alta, arrow, astm, cornell, curet, delimited, merl, nist, npy, npz, parquet, rgl
from ._format import Format
from ._size import at_most
from ._text import brief, number
from .delimited import write_csv
from .samples import ANGLE_UNITS, QUANTITIES, Masked, Samples

__all__ = ["ANGLE_UNITS", "FORMATS", "QUANTITIES", "Format", "Masked", "Samples", "at_most", "read", "write_csv"]

FORMATS: Final[dict[str, Format]] = {
    module.FORMAT.name: module.FORMAT
    for module in (delimited, cornell, merl, npz, npy, parquet, arrow, alta, astm, nist, curet, rgl)
}

HEAD = 64 * 1024  # bytes by which a file's format is told; a longer preamble needs format=
LARGEST = 2 * 2**30  # bytes of a file; what is in it takes several times as much memory


def read(
    path: str | PathLike[str],
    format: str | None = None,  # noqa: A002 - the fixed public name
    quantity: str | None = None,
    angle_unit: str | None = None,
    *,
    columns: str | Sequence[str] | None = None,
    material: int | str | None = None,
    rgb: bool = False,
) -> Samples:
    """The samples of a measured file, values in 1/sr; its format is told by its content, never by its extension.

    format      a name from FORMATS insists on that format
    quantity    "brdf", "brdf_cos" or "reflectance_factor", where the file does not say it
    angle_unit  "degrees" or "radians", where the file does not say it
    columns     the names of a table's columns as a header row has them, a list or separated by commas, where the file
                has none or other names
    material    which one, where a file holds several
    rgb         a spectrum as red, green and blue, as renderers take them (Samples.to_rgb)

    Raises FormatError (unreadable, unknown, damaged, or something is undeclared), SamplesError (a row is no
    reflectance measurement) or UnknownNameError; the message is one sentence with what to do.
    """
    for field, name, known in (
        ("format", format, tuple(FORMATS)),
        ("quantity", quantity, QUANTITIES),
        ("angle_unit", angle_unit, ANGLE_UNITS),
    ):
        if name is not None and name not in known:
            raise unknown_name(field, str(name), known, field=field)
    given = {name: value for name, value in (("columns", columns), ("material", material)) if value is not None}
    file = Path(path)
    try:
        head = _head(file)
        found = FORMATS[format or ("csv" if columns is not None else detect(head))]
        for field, value in given.items():
            if field not in found.options:
                raise FormatError(
                    f"Expected {field} to be left out, as a file of the format {found.name} takes none, "
                    f"got {str(value)[:40]!r}. Drop the argument.",
                    field=field,
                )
        samples = found.read(file, quantity, angle_unit, **given)
        return samples.to_rgb() if rgb else samples
    except OSError as error:
        raise FormatError(
            f"Expected path to be a readable file, got {file.name!r} ({error.strerror}). Check the path.", field="path"
        ) from error


def _head(file: Path) -> bytes:
    """The file's first bytes; FormatError where it is empty, too large, or a pipe, which could wait forever."""
    about = file.stat()
    if not stat.S_ISREG(about.st_mode) and not stat.S_ISDIR(about.st_mode):
        raise FormatError(
            f"Expected path to be a plain file, got a pipe or device, {file.name!r}. Save its content first.",
            field="path",
        )
    if about.st_size > LARGEST:
        raise FormatError(
            f"Expected {file.name} to be at most {LARGEST:,} bytes long, got {about.st_size:,}. "
            "Split it, or keep fewer samples.",
            field="path",
        )
    with file.open("rb") as opened:
        head = opened.read(HEAD)
    if not head:
        raise FormatError(f"Expected {file.name} to hold measurements, got an empty file. Check that it was saved.")
    return head


def detect(head: bytes) -> str:
    """The name of the one format that claims a file by its first bytes; FormatError where none or several do."""
    names = [name for name, format_ in FORMATS.items() if format_.sniff(head)]
    if len(names) == 1:
        return names[0]
    if names:
        raise FormatError(
            f"Expected the file to be of one format, got {' and '.join(names)}. Pass format.", field="format"
        )
    if curet.is_table(head):
        raise FormatError(
            f"Expected the file with CUReT's values, got {curet.TABLE}, which holds their directions alone. "
            f"Read abrdf.dat with {curet.TABLE} beside it; "
            "where only one can be sent, what `brdf convert` makes of them.",
            field="path",
        )
    raise FormatError(
        f"Expected the file to be of a known format, got {_beginning(head)} Known: {', '.join(FORMATS)}.",
        field="format",
    )


def _beginning(head: bytes) -> str:
    """What a file of no known format begins with, and what to do about it."""
    first = next((line for line in head.split(b"\n") if line.strip() and not line.lstrip().startswith(b"#")), b"")
    text = first.decode("utf-8-sig", errors="replace").strip()
    if not text:
        return "no line of data. Check that it is a measurement."
    if "\ufffd" in text or not text.replace("\t", " ").isprintable():
        return "unknown binary data. Check that it is a measurement."
    if all(number(word) is not None for word in text.replace(",", " ").split()):
        return f"the numbers {brief(text)} at its start. For a table without a header row, pass columns."
    return f"{brief(text)} at its start. For a table, format='csv' says what its header lacks."
