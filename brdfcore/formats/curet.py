"""The CUReT database's BRDFs: abrdf.dat (or rbrdf.dat, gbrdf.dat, bbrdf.dat) with table.txt beside it.

    abrdf.dat   61 rows: number of the material, then its BRDF [1/sr] in 205 geometries, averaged over red, green, blue
    table.txt   205 rows: number of the geometry, theta_v, phi_v, theta_i, phi_i [rad]

The file of values is what `read` is given, with the number of the material: `read("abrdf.dat", material=42)`. Both
directions leave the surface: the mirror direction is at phi_v = phi_i + 180 deg. Values are noisy; negative ones are
kept, and counted in the report.
Source: Dana, van Ginneken, Nayar and Koenderink, ACM Transactions on Graphics 18(1), 1999, and its database's pages.
"""

from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..errors import FormatError
from ._assemble import from_columns
from ._declared import declared
from ._format import Format
from ._header import ANGLES
from ._table import line_of, parse_rows
from ._text import head_text, number, text_of
from .samples import ANGLE_UNITS, QUANTITIES, Samples

GEOMETRIES = 205
TABLE = "table.txt"
_NAMES = ("number", "theta_v", "phi_v", "theta_i", "phi_i")

Array = npt.NDArray[np.float64]


def sniff(head: bytes) -> bool:
    """Whether the first row is a number from 1 on and as many values as there are geometries, all decimal numbers."""
    text = head_text(head)
    words = text.lstrip().split("\n", 1)[0].split() if text is not None else []
    numbers = [number(word) for word in words]
    return len(words) == 1 + GEOMETRIES and words[0].isdecimal() and None not in numbers and "." in words[1]


def is_table(head: bytes) -> bool:
    """Whether the file is the table of the directions, which holds no values."""
    rows = [line.split() for line in (head_text(head) or "").split("\n") if line.strip()]
    counted = [row[0] for row in rows] == [str(k + 1) for k in range(GEOMETRIES)]
    return counted and all(len(row) == len(_NAMES) for row in rows)


def read(path: Path, quantity: str | None, angle_unit: str | None, material: int | str | None = None) -> Samples:
    """The samples of one material of a CUReT file, values in 1/sr; FormatError names the file and line at fault."""
    declared("quantity", QUANTITIES, "brdf", quantity, "")
    declared("angle_unit", ANGLE_UNITS, "radians", angle_unit, "")
    values = _rows(path, ("number", *(f"value {k + 1}" for k in range(GEOMETRIES))))
    numbers = [f"{x:.9g}" for x in values[:, 0]]
    table = path.with_name(TABLE)
    if not table.is_file():
        raise FormatError(
            f"Expected {TABLE}, which holds the directions, to lie beside {path.name}, got none. "
            "Put the two files in one folder; where only one can be sent, send what `brdf convert` makes of them.",
            field="path",
        )
    if str(material) not in numbers or numbers.count(str(material)) > 1:
        listed = f"{numbers[0]} to {numbers[-1]}" if len(numbers) > 1 else numbers[0]
        raise FormatError(
            f"Expected material to be one of the {len(numbers)} numbers in {path.name} ({listed}), "
            f"got {'nothing' if material is None else str(material)[:40]}. Pass material.",
            field="material",
        )
    text = text_of(table)
    directions = _rows(table, _NAMES)
    if len(directions) != GEOMETRIES or (directions[:, 0] != np.arange(1, GEOMETRIES + 1)).any():
        raise FormatError(
            f"Expected {TABLE} to number its {GEOMETRIES} geometries from 1 on, got {len(directions)} rows. "
            "The file is damaged or truncated: fetch it again."
        )
    theta_o, phi_o, theta_i, phi_i = directions[:, 1:].T
    return from_columns(
        dict(zip(ANGLES, (theta_i, phi_i, theta_o, phi_o), strict=True)),
        values[numbers.index(str(material)), 1:, None],
        source=f"{path.name}, material {material}",
        format="curet",
        where=lambda row: f"line {line_of(text, 1, row)} of {TABLE}",
    )


def _rows(path: Path, names: tuple[str, ...]) -> Array:
    """The rows of one of the two files; FormatError names it where they are not as they should be."""
    try:
        return parse_rows(text_of(path), 1, None, names)
    except FormatError as error:
        raise FormatError(f"{error.message[:-1]}, in {path.name}.", field=error.field) from error


FORMAT = Format(
    name="curet",
    description="CUReT's abrdf.dat with table.txt beside it: 61 materials, of which the argument material picks one",
    sniff=sniff,
    read=read,
    options=("material",),
)
