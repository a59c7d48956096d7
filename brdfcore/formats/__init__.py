"""Measured data: the formats that can be read, and the samples that they yield.

A format's file holds one `Format`; listing it in FORMATS is all that the reader, the command line and the service need.
"""

from os import PathLike
from pathlib import Path
from typing import Final

from ..errors import FormatError, unknown_name
from . import cornell, delimited, merl, npz, rgl
from ._format import Format
from .delimited import write_csv
from .samples import ANGLE_UNITS, QUANTITIES, Masked, Samples

__all__ = ["ANGLE_UNITS", "FORMATS", "QUANTITIES", "Format", "Masked", "Samples", "read", "write_csv"]

FORMATS: Final[dict[str, Format]] = {
    module.FORMAT.name: module.FORMAT for module in (delimited, cornell, merl, npz, rgl)
}

HEAD = 64 * 1024  # bytes by which a file's format is told; a longer preamble needs format=


def read(
    path: str | PathLike[str],
    format: str | None = None,  # noqa: A002 - the fixed public name
    quantity: str | None = None,
    angle_unit: str | None = None,
) -> Samples:
    """The samples of a measured file, values in 1/sr; its format is told by its content, never by its extension.

    format      a name from FORMATS insists on that format
    quantity    "brdf", "brdf_cos" or "reflectance_factor", where the file does not say it
    angle_unit  "degrees" or "radians", where the file does not say it

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
    file = Path(path)
    try:
        with file.open("rb") as opened:
            head = opened.read(HEAD)
        if not head:
            raise FormatError(f"Expected {file.name} to hold measurements, got an empty file. Check that it was saved.")
        return FORMATS[format or detect(head)].read(file, quantity, angle_unit)
    except OSError as error:
        raise FormatError(
            f"Expected path to be a readable file, got {file.name!r} ({error.strerror}). Check the path.", field="path"
        ) from error


def detect(head: bytes) -> str:
    """The name of the one format that claims a file by its first bytes; FormatError where none or several do."""
    names = [name for name, format_ in FORMATS.items() if format_.sniff(head)]
    if len(names) == 1:
        return names[0]
    if names:
        raise FormatError(
            f"Expected the file to be of one format, got {' and '.join(names)}. Pass format.", field="format"
        )
    known = "; ".join(f"{name} ({format_.description})" for name, format_ in FORMATS.items())
    first = next((line for line in head.split(b"\n") if line.strip() and not line.lstrip().startswith(b"#")), b"")
    text = first.decode("ascii", errors="replace").strip()
    begins = (
        f" It begins with {text[:60]!r}; for a table, format='csv' says what its header lacks."
        if text.isprintable()
        else ""
    )
    raise FormatError(
        f"Expected the file to be of a known format, got none of them. Known: {known}.{begins}", field="format"
    )
