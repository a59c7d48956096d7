"""A delimited file's header row: which column is which."""

import re
from dataclasses import dataclass

from ..errors import FormatError
from ._text import brief, brief_list, number

VECTORS = ("wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z")
ANGLES = ("theta_i", "phi_i", "theta_o", "phi_o")
_ANGLE = re.compile(r"(theta|phi)_([iosr])(?:_(deg|rad))?")
_UNITS = {"deg": "degrees", "rad": "radians", None: None}
_FORM = (
    "Columns are theta_i_deg, phi_i_deg, theta_o_deg, phi_o_deg (or _rad) or wi_x .. wo_z; value or r, g, b "
    "or wavelengths in nm; and optionally sigma or sigma_<channel>, weight, cell."
)


@dataclass(frozen=True)
class Header:
    """The columns of a delimited file by what they hold; columns count from 0."""

    delimiter: str | None  # None is any white space
    names: tuple[str, ...]
    directions: dict[str, int]  # the keys are ANGLES or VECTORS
    units: dict[str, str | None]  # of each angle, where its name says it
    channels: tuple[str, ...]
    values: list[int]
    sigma: list[int]  # none, one for all channels, or one a channel
    extras: dict[str, int]  # weight, cell


def split_header(line: str) -> tuple[str | None, tuple[str, ...]]:
    """The delimiter that a header row uses, and its names in lower case."""
    delimiter = max(",;\t", key=line.count)
    found = delimiter if delimiter in line else None
    return found, tuple(name.strip().strip('"').lower() for name in line.strip(" ").split(found))


def is_direction(name: str) -> bool:
    """Whether a column's name is that of an angle or of a vector's component."""
    return name in VECTORS or _ANGLE.fullmatch(name) is not None


def parse_header(line: str) -> Header:
    """The columns that a header row names; FormatError where one is unknown, missing or there twice."""
    return header_of(*split_header(line))


def header_of(delimiter: str | None, names: tuple[str, ...]) -> Header:
    """What the columns of these names hold; FormatError where one is unknown, missing or there twice."""
    directions: dict[str, int] = {}
    units: dict[str, str | None] = {}
    extras: dict[str, int] = {}
    sigmas: dict[str, int] = {}
    values: dict[str, int] = {}
    for column, name in enumerate(names):
        role, key = values, name
        if angle := _ANGLE.fullmatch(name):
            role, key = directions, f"{angle[1]}_{'i' if angle[2] == 'i' else 'o'}"
            units[key] = _UNITS[angle[3]]
        elif name in VECTORS:
            role = directions
        elif name in ("weight", "cell"):
            role = extras
        elif name == "sigma" or name.startswith("sigma_"):
            role, key = sigmas, name.removeprefix("sigma").removeprefix("_")
        elif name not in ("value", "r", "g", "b") and not _is_wavelength(name):
            raise FormatError(
                f"Expected column {column + 1} of the header to be a known name, got {brief(name)}. {_FORM}",
                field=name[:40],
            )
        if key in role:
            raise FormatError(
                f"Expected every column to be there once, got {name!r} again. Remove one of them.", field=name
            )
        role[key] = column
    _check_directions(directions)
    channels = value_channels(tuple(values))
    if sigmas and set(sigmas) not in ({""}, set(channels)):
        raise FormatError(
            f"Expected sigma to be one column or one a channel ({brief_list(f'sigma_{c}' for c in channels)}), "
            f"got {brief_list(f'sigma_{c}' if c else 'sigma' for c in sigmas)}. Add or rename the columns.",
            field="sigma",
        )
    sigma = [sigmas[""]] if "" in sigmas else [sigmas[c] for c in channels if sigmas]
    return Header(delimiter, names, directions, units, channels, [values[c] for c in channels], sigma, extras)


def _is_wavelength(name: str) -> bool:
    wavelength = number(name)
    return wavelength is not None and wavelength > 0


def _check_directions(directions: dict[str, int]) -> None:
    if set(directions) not in (set(ANGLES), set(VECTORS)):
        vectors, angles = (sorted(set(directions) & set(names)) for names in (VECTORS, ANGLES))
        wanted = VECTORS if vectors and not angles else ANGLES
        raise FormatError(
            f"Expected the header to name {', '.join(wanted)}, and no other direction, "
            f"got {brief_list(directions) or 'none of them'}. {_FORM}",
            field=next((name for name in wanted if name not in directions), "wi_x"),
        )


def value_channels(names: tuple[str, ...]) -> tuple[str, ...]:
    """The channels' names: value, or r, g, b in this order, or wavelengths in the file's order."""
    if set(names) == {"r", "g", "b"}:
        return ("r", "g", "b")
    wavelengths = [number(name) for name in names]
    if names != ("value",) and (not names or None in wavelengths or len(set(wavelengths)) < len(names)):
        raise FormatError(
            f"Expected the value columns to be value, or r, g, b, or distinct wavelengths in nm, "
            f"got {brief_list(names) or 'none'}. {_FORM}",
            field="values",
        )
    return names
