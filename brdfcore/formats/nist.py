"""NIST's Mueller-matrix BRDF as CSV (sintered PTFE): a header row, then one wavelength and geometry a row.

    lambda,thetai,phi,thetar,phir,f_r11,f_r12/f_r11, ... ,f_r44/f_r11
    0.351,-15,0,80.0258,-156.038,2.62E-01,0.0127079, ...

lambda is in micrometres, angles are in degrees, f_r11 is the unpolarised BRDF [1/sr] (also spelt fr11, phii). The other
elements of the matrix are read past. A channel is a wavelength, named in nm; a geometry that was not measured at every
wavelength is masked. A negative thetai means the same tilt at phi + 180 deg, so the mirror direction is at phir = phi.
Source: Germer, Applied Optics 56, 2017, and the notes with its data.
"""

from collections import Counter
from pathlib import Path

import numpy as np

from ..errors import FormatError
from ._assemble import from_columns
from ._declared import declared
from ._format import Format
from ._table import line_of, parse_rows
from ._text import brief_list, head_text, text_of
from .samples import ANGLE_UNITS, QUANTITIES, Samples

_SPELLINGS = {"fr11": "f_r11", "phii": "phi"}
_NEEDED = ("lambda", "thetai", "phi", "thetar", "phir", "f_r11")
_MOST_WAVELENGTHS = 1000


def sniff(head: bytes) -> bool:
    """Whether the header row names the columns as NIST does."""
    text = head_text(head)
    return text is not None and set(_NEEDED) <= set(_names(text.lstrip("\n").split("\n", 1)[0]))


def read(path: Path, quantity: str | None, angle_unit: str | None) -> Samples:
    """The unpolarised BRDF of a NIST file, one channel a wavelength; FormatError or SamplesError names the line."""
    declared("quantity", QUANTITIES, "brdf", quantity, "")
    declared("angle_unit", ANGLE_UNITS, "degrees", angle_unit, "")
    text = text_of(path)
    start = len(text) - len(text.lstrip("\n"))
    line, _, body = text[start:].partition("\n")
    names, first_line = _names(line), start + 2
    if not set(_NEEDED) <= set(names) or len(set(names)) < len(names):
        raise FormatError(
            f"Expected a header row that names {', '.join(_NEEDED)}, each once, got {brief_list(names)}. "
            "Check that this is a NIST file."
        )
    rows = parse_rows(body, first_line, ",", names)
    needed = rows[:, [names.index(name) for name in _NEEDED]]

    def where(row: int) -> str:
        return f"line {line_of(body, first_line, row)}"

    bad = np.isnan(needed).any(-1) | (needed[:, 0] <= 0)
    if bad.any():
        raise FormatError(
            f"Expected a positive wavelength, four angles and f_r11, got an empty cell or none at "
            f"{where(int(bad.argmax()))}. Correct the row or remove it."
        )
    wavelengths, channel = np.unique(needed[:, 0], return_inverse=True)
    if len(wavelengths) > _MOST_WAVELENGTHS:
        raise FormatError(
            f"Expected at most {_MOST_WAVELENGTHS} wavelengths, got {len(wavelengths)}. "
            "Check that lambda is the first column."
        )
    geometry = _repeats_apart(needed[:, 1:5], channel)
    _, first, index = np.unique(geometry, axis=0, return_index=True, return_inverse=True)
    values = np.full((len(first), len(wavelengths)), np.nan)
    values[index, channel] = needed[:, 5]
    order = np.argsort(first)  # as the file has them
    angles = np.deg2rad(needed[first[order], 1:5])
    return from_columns(
        {name: angles[:, k] for k, name in enumerate(("theta_i", "phi_i", "theta_o", "phi_o"))},
        values[order],
        channels=tuple(f"{1000 * wavelength:.9g}" for wavelength in wavelengths),
        source=path.name,
        format="nist",
        where=lambda row: where(int(first[order[row]])),
    )


def _names(line: str) -> tuple[str, ...]:
    names = [name.strip().strip('"').lower() for name in line.split(",")]
    return tuple(_SPELLINGS.get(name, name) for name in names)


def _repeats_apart(angles: "np.ndarray[tuple[int, int], np.dtype[np.float64]]", channel: "np.ndarray") -> "np.ndarray":
    """The four angles and how often they were there before at the same wavelength: a repeated geometry is kept."""
    seen: Counter[tuple[float, ...]] = Counter()
    times = np.empty(len(angles))
    for row, key in enumerate(zip(*angles.T.tolist(), channel.tolist(), strict=True)):
        times[row] = seen[key]
        seen[key] += 1
    return np.column_stack([angles, times])


FORMAT = Format(
    name="nist",
    description="NIST Mueller-matrix CSV: lambda, thetai, phi, thetar, phir, f_r11 and the other elements",
    sniff=sniff,
    read=read,
)
