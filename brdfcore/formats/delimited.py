"""CSV and its kin: a header row, then one sample a row; comma, semicolon, tab or white space between the cells.

    # quantity: brdf                                  the quantity, here or as an argument
    # angle_unit: degrees                             only where the angles' names lack _deg or _rad
    theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,r,g,b,sigma_r,sigma_g,sigma_b,weight
    45,0,45,180,1.25,1.5,1.75,.01,.01,.01,1

Directions: theta_i, phi_i and theta_o, phi_o (theta_s and theta_r mean theta_o), or wi_x .. wo_z. Values: one column
`value`, or r, g, b, or one column a wavelength in nm. A sample with an empty value cell, or with a direction at the
horizon, is masked. `# azimuth_observed: false` says that the sample was never turned about its normal, whatever wi
does. Other comment lines are ignored.
"""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import torch

from ..errors import FormatError
from ._assemble import from_columns
from ._declared import declared
from ._format import Format
from ._header import ANGLES, VECTORS, Header, is_direction, parse_header, split_header, value_channels
from ._table import line_of, parse_rows
from ._text import brief, head_text, text_of
from .samples import ANGLE_UNITS, QUANTITIES, Samples, SamplesKeywords, angles

_COMMENT = re.compile(r"^[ \t]*#[ \t]*(\w+)[ \t]*:(.*)$", re.MULTILINE)
_DECLARATIONS = ("quantity", "angle_unit", "azimuth_observed")
_DECLARE_UNIT = (
    "Name the columns theta_i_deg or theta_i_rad, add the line '# angle_unit: degrees' (or radians) to the file, "
    "or pass angle_unit."
)
_DECLARE_QUANTITY = "Add the line '# quantity: brdf' (or another of them) to the file, or pass quantity."


def sniff(head: bytes) -> bool:
    """Whether the first row that is no comment names a direction as only this format does."""
    text = head_text(head)
    found = _header_line(text) if text is not None else None
    return found is not None and any(is_direction(name) for name in split_header(found[0])[1])


def read(path: Path, quantity: str | None, angle_unit: str | None) -> Samples:
    """The samples of a delimited file, values in 1/sr; FormatError or SamplesError names the line at fault."""
    text = text_of(path)
    found = _header_line(text)
    if found is None:
        raise FormatError("Expected a header row that names the columns, got none. Add it above the data.")
    line, start, first_line = found
    comments = _declarations(text)
    header = parse_header(line)
    measured_quantity = declared("quantity", QUANTITIES, comments.get("quantity"), quantity, _DECLARE_QUANTITY)
    units = {name: _unit(name, header, comments.get("angle_unit"), angle_unit) for name in header.units}
    body = text[start:]
    rows = parse_rows(body, first_line, header.delimiter, header.names)
    needed = [column for column in range(len(header.names)) if column not in header.values]
    empty = np.isnan(rows[:, needed])
    if empty.any():
        row, index = (int(k) for k in np.argwhere(empty)[0])
        name = header.names[needed[index]]
        raise FormatError(
            f"Expected {name} at line {line_of(body, first_line, row)} to be a number, got an empty cell. "
            "Fill it in or remove the row; only a value may be empty.",
            field=name,
        )
    columns = {name: rows[:, column] for name, column in header.directions.items()}
    if units:
        directions = {name: np.deg2rad(columns[name]) if units[name] == "degrees" else columns[name] for name in ANGLES}
    else:
        directions = {w: np.stack([columns[name] for name in VECTORS if name.startswith(w)], -1) for w in ("wi", "wo")}
    keywords: SamplesKeywords = {
        "channels": header.channels,
        "quantity": measured_quantity,
        "source": path.name,
        "format": "csv",
        "where": lambda row: f"line {line_of(body, first_line, row)}",
        "azimuth_observed": _azimuth_observed(comments.get("azimuth_observed")),
    }
    if header.sigma:
        keywords["sigma"] = np.broadcast_to(rows[:, header.sigma], (len(rows), len(header.channels)))
    if "weight" in header.extras:
        keywords["weight"] = rows[:, header.extras["weight"]]
    if "cell" in header.extras:
        keywords["cell"] = rows[:, header.extras["cell"]]
    return from_columns(directions, rows[:, header.values], **keywords)


def write_csv(samples: Samples, path: str | Path, comments: Mapping[str, str] | None = None) -> None:
    """None; writes the samples as the BRDF [1/sr] with angles in degrees, so that `read` returns the same ones.

    Numbers are exact but for the angles, rounded to 13 decimals (9e-16 rad, the rounding of the directions
    themselves). `comments` become lines `# key: value` at the top. Raises FormatError for channels or comments that
    would not read back.
    """
    value_channels(samples.channels)
    stated = {"quantity": "brdf"}
    if samples.azimuth_declared is not None:
        stated["azimuth_observed"] = str(samples.azimuth_declared).lower()
    for key, text in (comments or {}).items():
        if re.fullmatch(r"\w+", key) is None or key.lower() in _DECLARATIONS or re.search(r"[\r\n]", text) is not None:
            raise FormatError(
                f"Expected comments to be one line each under a name of their own, got {key!r}: {text!r}. "
                f"Use a name of letters and digits other than {', '.join(_DECLARATIONS)}, and no line break.",
                field="comments",
            )
    names = [f"{name}_deg" for name in ANGLES]
    columns = [torch.rad2deg(angle).round(decimals=13) for w in (samples.wi, samples.wo) for angle in angles(w)]
    names += samples.channels
    columns += samples.values.unbind(1)
    if samples.sigma is not None:
        names += ["sigma"] if len(samples.channels) == 1 else [f"sigma_{channel}" for channel in samples.channels]
        columns += samples.sigma.unbind(1)
    for name, column in (("weight", samples.weight), ("cell", samples.cell)):
        if column is not None:
            names.append(name)
            columns.append(column)
    with Path(path).open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(f"# {key}: {text}\n" for key, text in {**(comments or {}), **stated}.items())
        file.write(",".join(names) + "\n")
        # repr is the shortest text that reads back as the same float64
        file.writelines(",".join(map(repr, row)) + "\n" for row in torch.stack(columns, 1).tolist())


def _header_line(text: str) -> tuple[str, int, int] | None:
    """The first line that is neither blank nor comment, where the text goes on after it, and that line's number."""
    start = 0
    line = 1
    while start < len(text):
        end = text.find("\n", start)
        end = len(text) if end < 0 else end
        content = text[start:end]
        start, line = end + 1, line + 1
        if content.strip() and not content.lstrip().startswith("#"):
            return content, start, line
    return None


def _declarations(text: str) -> dict[str, str]:
    """What the comment lines declare, in lower case."""
    found: dict[str, str] = {}
    for match in _COMMENT.finditer(text):
        key, value = match[1].lower(), match[2].strip().lower()
        if key in _DECLARATIONS and found.setdefault(key, value) != value:
            raise FormatError(
                f"Expected {key} to be declared once, got {brief(found[key])} and {brief(value)}. "
                "Remove the wrong comment line.",
                field=key,
            )
    return found


def _unit(name: str, header: Header, comment: str | None, argument: str | None) -> str:
    """The unit of one angle: by its name, by a comment line or by the argument, which must agree."""
    in_name = header.units[name]
    if in_name is not None and comment is not None and in_name != comment:
        raise FormatError(
            f"Expected angle_unit to be {in_name!r} as the column {name} has it, got {brief(comment)} in a comment. "
            "Correct one of them.",
            field="angle_unit",
        )
    return declared("angle_unit", ANGLE_UNITS, in_name or comment, argument, _DECLARE_UNIT)


def _azimuth_observed(comment: str | None) -> bool | None:
    return None if comment is None else declared("azimuth_observed", ("true", "false"), comment, None, "") == "true"


FORMAT = Format(
    name="csv",
    description="CSV, TSV or columns: a header row with theta_i, phi_i, theta_o, phi_o or wi_x .. wo_z, then values",
    sniff=sniff,
    read=read,
)
