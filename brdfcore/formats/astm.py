"""ASTM E1392-style text: keys in capitals, the columns' names after VARS, then rows with commas between the numbers.

    NUM_POINTS 1439
    VARS theta_i,phi_i,theta_s,phi_s,R,G,B
    0.87,0,0.57,0,.02,.01,.01

Some instruments leave phi_s out of VARS although its column is there, after theta_s: a row then has one number more
than VARS names. Files without a column phi_i have it 0 throughout, so the sample's azimuth was not observed. Values are
one column of any name, or R, G, B, or X, Y, Z, or one a wavelength in nm. A column named brdf or bsdf says the
quantity, and ANGLE_UNIT (or names that end in _deg or _rad) the unit; what the file leaves unsaid is declared as an
argument. The mirror direction is at phi_s = phi_i + 180 deg.
"""

import re
from pathlib import Path

import numpy as np

from ..errors import FormatError
from ._assemble import from_columns
from ._declared import declared
from ._format import Format
from ._table import line_of, parse_rows
from ._text import brief, brief_list, head_text, number, text_of
from .samples import ANGLE_UNITS, QUANTITIES, Samples

_VARS = re.compile(r"^[ \t]*VARS\b[ \t]*(.*)$", re.MULTILINE | re.IGNORECASE)
_POINTS = re.compile(r"^[ \t]*NUM_POINTS\b[ \t]*(.*)$", re.MULTILINE | re.IGNORECASE)
_UNIT = re.compile(r"^[ \t]*ANGLE_UNITS?\b[ \t]*(.*)$", re.MULTILINE | re.IGNORECASE)
_ANGLE = re.compile(r"(theta|phi)_([isor])(?:_(deg|rad))?", re.IGNORECASE)
_UNITS = {"deg": "degrees", "rad": "radians", "degree": "degrees", "radian": "radians"}
_BRDF = ("brdf", "bsdf")
_COLOURS = ("r", "g", "b"), ("x", "y", "z")


def sniff(head: bytes) -> bool:
    """Whether a line begins with VARS and names theta_i."""
    text = head_text(head)
    found = _VARS.search(text) if text is not None else None
    return found is not None and "theta_i" in found[1].lower()


def read(path: Path, quantity: str | None, angle_unit: str | None) -> Samples:
    """The samples of an ASTM-style file, values in 1/sr; FormatError or SamplesError names the line at fault."""
    text = text_of(path)
    found = _VARS.search(text)
    if found is None:
        raise FormatError(
            "Expected a line VARS that names the columns, got none. Check that this is an ASTM file.", field="VARS"
        )
    head, body, first_line = text[: found.start()], text[found.end() :], text.count("\n", 0, found.end()) + 1
    names = [name.strip().strip('"') for name in found[1].rstrip(",; \t").split(",")]
    angles, units = _angles(names)
    delimiter = "," if "," in body else None
    if "phi_s" not in angles and _width(body, delimiter) == len(names) + 1:
        names.insert(angles["theta_s"] + 1, "phi_s")
        angles, units = _angles(names)
    for name in ("phi_s", "theta_i", "theta_s"):
        if name not in angles:
            raise FormatError(
                f"Expected VARS to name {name}, or to leave out phi_s alone while its column is there, "
                f"got {brief_list(names)}. Correct the line.",
                field="VARS",
            )
    others = [column for column in range(len(names)) if column not in angles.values()]
    channels = _channels([names[column] for column in others])
    in_file = "brdf" if [names[column].lower() for column in others] in [[name] for name in _BRDF] else None
    how = "VARS does not say it: pass quantity."
    measured_quantity = declared("quantity", QUANTITIES, in_file, quantity, how)
    unit = declared(
        "angle_unit", ANGLE_UNITS, _unit(head, units), angle_unit, "The file does not say it: pass angle_unit."
    )
    rows = parse_rows(body, first_line, delimiter, tuple(names))

    def where(row: int) -> str:
        return f"line {line_of(body, first_line, row)}"

    _check_count(head, len(rows))
    empty = np.isnan(rows[:, sorted(angles.values())]).any(-1)
    if empty.any():
        raise FormatError(
            f"Expected every angle to be a number, got an empty cell at {where(int(empty.argmax()))}. Remove the row."
        )
    scale = np.pi / 180 if unit == "degrees" else 1.0
    zeros = np.zeros(len(rows))
    sides = {"theta_i": "theta_i", "phi_i": "phi_i", "theta_o": "theta_s", "phi_o": "phi_s"}
    return from_columns(
        {ours: rows[:, angles[theirs]] * scale if theirs in angles else zeros for ours, theirs in sides.items()},
        rows[:, others],
        channels=channels,
        quantity=measured_quantity,
        source=path.name,
        format="astm",
        where=where,
        azimuth_observed=None if "phi_i" in angles else False,
    )


def _angles(names: list[str]) -> tuple[dict[str, int], set[str]]:
    """The column of each angle, and the units that their names state."""
    columns: dict[str, int] = {}
    units = set()
    for column, name in enumerate(names):
        angle = _ANGLE.fullmatch(name)
        if angle is None:
            continue
        key = f"{angle[1]}_{'i' if angle[2].lower() == 'i' else 's'}".lower()
        if key in columns:
            raise FormatError(f"Expected VARS to name {key} once, got it twice. Correct the line.", field="VARS")
        columns[key] = column
        units |= {_UNITS[angle[3].lower()]} if angle[3] else set()
    if "theta_s" not in columns:
        raise FormatError(f"Expected VARS to name theta_s, got {brief_list(names)}. Correct the line.", field="VARS")
    return columns, units


def _unit(head: str, in_names: set[str]) -> str | None:
    """The unit that the file states, or None."""
    line = _UNIT.search(head)
    stated = set(in_names)
    if line is not None:
        word = line[1].strip().strip('"').lower()
        stated.add(_UNITS.get(word.rstrip("s"), word))
    if len(stated) > 1:
        raise FormatError(
            f"Expected one unit of angles, got {brief_list(sorted(stated))}. Correct the file.", field="angle_unit"
        )
    return stated.pop() if stated else None


def _channels(names: list[str]) -> tuple[str, ...] | None:
    lower = tuple(name.lower() for name in names)
    if len(names) == 1:
        return None if number(names[0]) is None else (names[0],)
    wavelengths = [number(name) for name in names]
    if lower in _COLOURS or (names and None not in wavelengths and len(set(wavelengths)) == len(names)):
        return lower
    raise FormatError(
        "Expected the values to be one column, or R, G, B, or X, Y, Z, or wavelengths in nm, "
        f"got {brief_list(names) or 'none'}. Correct VARS, or remove the other columns.",
        field="VARS",
    )


def _width(body: str, delimiter: str | None) -> int:
    """How many cells the first row has."""
    row = next((line for line in body.split("\n") if line.split("#", 1)[0].strip()), "")
    return len(row.split("#", 1)[0].split(delimiter))


def _check_count(head: str, rows: int) -> None:
    found = _POINTS.search(head)
    if found is None:
        return
    text = found[1].strip()
    if not (text.isascii() and text.isdecimal() and len(text) < 19) or int(text) != rows:
        raise FormatError(
            f"Expected as many rows as NUM_POINTS says, {brief(text)[1:-1] or 'nothing'}, got {rows}. "
            "The file is damaged or truncated: fetch it again.",
            field="NUM_POINTS",
        )


FORMAT = Format(
    name="astm",
    description="ASTM E1392-style text: NUM_POINTS, VARS with the columns' names, then rows; angle_unit is declared",
    sniff=sniff,
    read=read,
)
