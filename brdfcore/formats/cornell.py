"""The Cornell gonioreflectometer's text format, `.brdf` (also pbrt's "measured" material for scattered samples).

    # comment lines
    31                                            number of wavelengths
    400 410 ... 700                               wavelengths [nm]
    theta_i phi_i theta_s phi_s value ... value   one sample: angles [rad], then the BRDF [1/sr] a wavelength

Both directions leave the surface: the mirror direction is at phi_s = phi_i + 180 deg. A channel is named by its
wavelength. Exact zeros, which this instrument writes for "no signal", are kept and counted in the report.
"""

from array import array
from itertools import pairwise
from pathlib import Path

import numpy as np

from ..errors import FormatError
from ._assemble import from_columns
from ._declared import declared
from ._format import Format
from ._header import ANGLES
from ._text import brief, head_text, number, text_of
from .samples import ANGLE_UNITS, QUANTITIES, Samples

SHORTEST, LONGEST = 100.0, 100_000.0  # wavelengths [nm] of any reflectometer; other numbers are another format's


def sniff(head: bytes) -> bool:
    """Whether the first numbers are a count and as many rising wavelengths, with whole samples after them."""
    text = head_text(head)
    if text is None:
        return False
    tokens = [token for line in text.split("\n") for token in line.split("#", 1)[0].split()]
    if not tokens or not tokens[0].isascii() or not tokens[0].isdecimal() or len(tokens[0]) > 4:
        return False
    count = int(tokens[0])
    numbers = [number(token) for token in tokens[1 : 1 + count]]
    return count > 0 and len(numbers) == count and _are_wavelengths(numbers)


def read(path: Path, quantity: str | None, angle_unit: str | None) -> Samples:
    """The samples of a Cornell file, values in 1/sr; FormatError names the line at fault."""
    declared("quantity", QUANTITIES, "brdf", quantity, "")
    declared("angle_unit", ANGLE_UNITS, "radians", angle_unit, "")
    numbers, lines = array("d"), array("q")  # and the line of each; lists would take five times the memory
    for line, content in enumerate(text_of(path).split("\n"), 1):
        for token in content.split("#", 1)[0].split():
            value = number(token)
            if value is None:
                raise FormatError(f"Expected line {line} to hold finite numbers, got {brief(token)}. Correct the file.")
            numbers.append(value)
            lines.append(line)
    count = int(numbers[0]) if numbers and 1 <= numbers[0] < len(numbers) else 0
    wavelengths = numbers[1 : 1 + count].tolist()
    if count == 0 or count != numbers[0] or not _are_wavelengths(wavelengths):
        raise FormatError(
            f"Expected the number of wavelengths, then the wavelengths in nm in rising order, "
            f"got {' '.join(f'{x:g}' for x in numbers[:4]) or 'no numbers'}. Check that this is a Cornell .brdf file."
        )
    width = len(ANGLES) + count
    table = np.array(numbers[1 + count :])
    if len(table) == 0 or len(table) % width:
        raise FormatError(
            f"Expected rows of {width} numbers (4 angles and {count} values) after the wavelengths, "
            f"got {len(table)} numbers, which is {len(table) // width} rows and {len(table) % width} over "
            f"(the last at line {lines[-1]}). The file is damaged or truncated: fetch it again."
        )
    rows = table.reshape(-1, width)
    return from_columns(
        {name: rows[:, column].copy() for column, name in enumerate(ANGLES)},
        rows[:, len(ANGLES) :],
        channels=tuple(f"{wavelength:.9g}" for wavelength in wavelengths),
        source=path.name,
        format="cornell",
        where=lambda row: f"line {lines[1 + count + row * width]}",
    )


def _are_wavelengths(numbers: list[float] | list[float | None]) -> bool:
    known = [x for x in numbers if x is not None and SHORTEST <= x <= LONGEST]
    return len(known) == len(numbers) and all(a < b for a, b in pairwise(known))


FORMAT = Format(
    name="cornell",
    description="Cornell .brdf text: number of wavelengths, the wavelengths, then rows of four angles and the values",
    sniff=sniff,
    read=read,
)
