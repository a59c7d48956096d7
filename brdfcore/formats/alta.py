"""ALTA's text format: a header of `#KEY value` lines, then one sample a line.

    #DIM 6 3                    how many numbers say where, and how many values follow them
    #PARAM_IN CARTESIAN         what those numbers are; angles are in radians
    #PARAM_OUT INV_STERADIAN    the BRDF; every other quantity has to be declared as an argument
    #VS 1 1 1                   per value: 0, or 1 number (a radius) or 2 (an interval) that follow the values
    x_1 ... x_N  y_1 ... y_P  segments

Read are the parametrisations that give both directions, of a view V and a light L, H = (L + V)/2 and B = (L - V)/2:

    CARTESIAN                   V then L, unit vectors
    SPHERICAL_TL_PL_TV_PV       theta and phi of L, then of V
    RUSIN_TH_PH_TD_PD           half and difference angles; the difference vector is where V goes when H turns to z
    RUSIN_TH_TD_PD              the same with phi_h = 0: an isotropic material
    ISOTROPIC_TV_TL_DPHI        theta of V, theta of L, phi_L - phi_V; isotropic
    ISOTROPIC_TL_TV_PROJ_DPHI   theta of L, then theta_V (cos, sin) of the difference of azimuth; isotropic
    STARK_3D                    length of H's projection, length of B, phi_B - phi_H; isotropic
    NEUMANN_3D                  lengths of the projections of H and of B, phi_B - phi_H; isotropic

Vertical segments are bounds that ALTA's fitters keep within, not standard deviations: they are read past.
Source: ALTA's page on data file formats and the notes in its params.h (Belcour and others, Inria). Departures: its code
turns B round in STARK_3D and NEUMANN_3D against its own definition, which a reciprocal material cannot show.
INV_STERADIAN_COSINE_FACTOR is defined by a note alone, of another cosine than brdf_cos: the caller has to declare it.
Parametrisations whose definition and code disagree (SCHLICK_TL_TK_PROJ_DPHI, RETRO_TL_TVL_PROJ_DPHI, STEREOGRAPHIC) are
refused, as are those that leave a direction open.
"""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..errors import FormatError
from ._assemble import from_columns
from ._declared import declared
from ._format import Format
from ._table import line_of, parse_rows
from ._text import brief, text_of
from .samples import ANGLE_UNITS, QUANTITIES, Samples

Array = npt.NDArray[np.float64]
Directions = tuple[Array, Array]  # V and L, (N, 3)

_KEY = re.compile(r"^#([A-Za-z_]+)[ \t]*(.*)$", re.MULTILINE)
_DIM = re.compile(rb"^#DIM[ \t]+\d+[ \t]+\d+[ \t\r]*$", re.MULTILINE)
_BINARY = re.compile(rb"^#FORMAT[ \t]+binary\b", re.MULTILINE)
_HEADER = 65_536  # bytes within which the header says so
_QUANTITY = {"INV_STERADIAN": "brdf"}
_WEIGHTED = (
    "by ALTA's notes the BRDF times the outgoing direction's cosine, which nothing in ALTA computes: "
    "if the cosine is the light's, pass quantity='brdf_cos'; else divide by it and write INV_STERADIAN."
)
_CHANNELS = {"RGB_COLOR": ("r", "g", "b"), "XYZ_COLOR": ("x", "y", "z")}
_MOST = 1000  # numbers in a row, beyond which the header is damaged


def _direction(theta: Array, phi: Array) -> Array:
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)


def _cartesian(x: Array) -> Directions:
    return x[:, :3], x[:, 3:]


def _spherical(x: Array) -> Directions:
    return _direction(x[:, 2], x[:, 3]), _direction(x[:, 0], x[:, 1])


def _rusinkiewicz(x: Array) -> Directions:
    theta_h, phi_h, theta_d, phi_d = x.T
    d, c, s = _direction(theta_d, phi_d), np.cos(theta_h), np.sin(theta_h)
    turned = np.stack([c * d[:, 0] + s * d[:, 2], d[:, 1], c * d[:, 2] - s * d[:, 0]], -1)  # about y by theta_h
    c, s = np.cos(phi_h), np.sin(phi_h)
    view = np.stack([c * turned[:, 0] - s * turned[:, 1], s * turned[:, 0] + c * turned[:, 1], turned[:, 2]], -1)
    half = _direction(theta_h, phi_h)
    return view, 2 * (view * half).sum(-1, keepdims=True) * half - view


def _rusinkiewicz_isotropic(x: Array) -> Directions:
    return _rusinkiewicz(np.insert(x, 1, 0.0, axis=1))


def _difference_of_azimuth(x: Array) -> Directions:
    return _direction(x[:, 0], np.zeros(len(x))), _direction(x[:, 1], x[:, 2])


def _projected_azimuth(x: Array) -> Directions:
    view = _direction(np.hypot(x[:, 1], x[:, 2]), np.arctan2(x[:, 2], x[:, 1]))
    return view, _direction(x[:, 0], np.zeros(len(x)))


def _stark(x: Array) -> Directions:
    across, length, azimuth = x.T
    up = np.sqrt(1 - across**2 - length**2)  # of H; L and V have length 1, so |H|^2 + |B|^2 = 1
    tilt = np.arctan2(up, -across * np.cos(azimuth))  # of B from the normal, at right angles to H
    return _half_and_back(np.stack([across, 0 * across, up], -1), length[:, None] * _direction(tilt, azimuth))


def _neumann(x: Array) -> Directions:
    flat = np.stack([x[:, 0], np.zeros(len(x))], -1), x[:, 1:2] * np.stack([np.cos(x[:, 2]), np.sin(x[:, 2])], -1)
    view, light = flat[0] - flat[1], flat[0] + flat[1]
    return _lifted(view), _lifted(light)


def _half_and_back(half: Array, back: Array) -> Directions:
    return half - back, half + back


def _lifted(flat: Array) -> Array:
    return np.concatenate([flat, np.sqrt(1 - (flat**2).sum(-1, keepdims=True))], -1)


# by name: numbers, whether they give no azimuth of the material itself, and the directions
_GEOMETRIES: dict[str, tuple[int, bool, Callable[[Array], Directions]]] = {
    "CARTESIAN": (6, False, _cartesian),
    "SPHERICAL_TL_PL_TV_PV": (4, False, _spherical),
    "RUSIN_TH_PH_TD_PD": (4, False, _rusinkiewicz),
    "RUSIN_TH_TD_PD": (3, True, _rusinkiewicz_isotropic),
    "ISOTROPIC_TV_TL_DPHI": (3, True, _difference_of_azimuth),
    "ISOTROPIC_TL_TV_PROJ_DPHI": (3, True, _projected_azimuth),
    "STARK_3D": (3, True, _stark),
    "NEUMANN_3D": (3, True, _neumann),
}


def sniff(head: bytes) -> bool:
    """Whether a line gives the dimensions as ALTA does."""
    return _DIM.search(head) is not None


def read(path: Path, quantity: str | None, angle_unit: str | None) -> Samples:
    """The samples of an ALTA text file, values in 1/sr; FormatError or SamplesError names the line at fault."""
    declared("angle_unit", ANGLE_UNITS, "radians", angle_unit, "")
    with path.open("rb") as file:
        binary = _BINARY.search(file.read(_HEADER)) is not None
    if binary:  # which is no text from here on
        raise FormatError(
            "Expected an ALTA file in its text format, got its binary format. Convert it with ALTA's data2data.",
            field="format",
        )
    text = text_of(path)
    keys: dict[str, str] = {}
    for key, value in _KEY.findall(text):
        keys.setdefault(key, value.strip())
    name, (given, isotropic, directions) = _geometry(keys.get("PARAM_IN", "nothing"))
    dimensions, count = _dimensions(keys.get("DIM", ""))
    if dimensions != given:
        raise FormatError(
            f"Expected DIM to begin with {given}, as {name} takes, got {dimensions}. Correct the header.", field="DIM"
        )
    out = keys.get("PARAM_OUT", "nothing")
    how = _WEIGHTED if out == "INV_STERADIAN_COSINE_FACTOR" else "which does not say it: pass quantity."
    how = f"PARAM_OUT is {brief(out)[1:-1]}, {how}"
    measured_quantity = declared("quantity", QUANTITIES, _QUANTITY.get(out), quantity, how)
    channels = _CHANNELS.get(out) if _CHANNELS.get(out) is not None and count == 3 else None
    segments = _segments(keys.get("VS", ""), count)
    names = (*(f"x{k + 1}" for k in range(given)), *(f"y{k + 1}" for k in range(count)))
    names += tuple(f"segment {k + 1}" for k in range(segments))
    rows = parse_rows(text, 1, None, names)
    with np.errstate(invalid="ignore"):  # coordinates beyond the parametrisation's range, which the next lines name
        wo, wi = directions(rows[:, :given])

    def where(row: int) -> str:
        return f"line {line_of(text, 1, row)}"

    outside = ~(np.isfinite(wi) & np.isfinite(wo)).all(-1)
    if outside.any():
        row = int(outside.argmax())
        numbers = ", ".join(f"{x:.9g}" for x in rows[row, :given])
        raise FormatError(
            f"Expected {name} to give two directions, got none from ({numbers}) at {where(row)}. Remove the row."
        )
    return from_columns(
        {"wi": wi, "wo": wo},
        rows[:, given : given + count],
        channels=channels,
        quantity=measured_quantity,
        source=path.name,
        format="alta",
        where=where,
        azimuth_observed=False if isotropic else None,
    )


def _geometry(name: str) -> tuple[str, tuple[int, bool, Callable[[Array], Directions]]]:
    if name not in _GEOMETRIES:
        raise FormatError(
            f"Expected PARAM_IN to be a parametrisation that gives both directions, got {brief(name)[1:-1]}. "
            f"Convert it with ALTA's data2data to one of {', '.join(_GEOMETRIES)}.",
            field="PARAM_IN",
        )
    return name, _GEOMETRIES[name]


def _dimensions(text: str) -> tuple[int, int]:
    """The two numbers of #DIM."""
    numbers = [int(word) for word in text.split() if word.isascii() and word.isdecimal() and len(word) < 6]
    if len(numbers) != 2 or len(text.split()) != 2 or not 1 <= numbers[1] <= _MOST:
        raise FormatError(
            f"Expected #DIM to give how many coordinates and how many values (1 to {_MOST}) a row has, "
            f"got {brief(text)}. Correct the header.",
            field="DIM",
        )
    return numbers[0], numbers[1]


def _segments(text: str, count: int) -> int:
    """How many numbers follow the values in a row."""
    words = text.split() or ["0"]
    if set(words) - {"0", "1", "2"} or len(words) not in (1, count):
        raise FormatError(
            f"Expected #VS to be 0, 1 or 2, once or for each of {count} values, got {brief(text)}. Correct the header.",
            field="VS",
        )
    return sum(map(int, words))


FORMAT = Format(
    name="alta",
    description="ALTA text: #DIM, #PARAM_IN, #PARAM_OUT, then rows of coordinates and values",
    sniff=sniff,
    read=read,
)
