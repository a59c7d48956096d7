"""CSV and its kin: a header row, then one sample a row; comma, semicolon, tab or white space between the cells.

    # quantity: brdf                                  the quantity, here or as an argument
    # angle_unit: degrees                             only where the angles' names lack _deg or _rad
    theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,r,g,b,sigma_r,sigma_g,sigma_b,weight
    45,0,45,180,1.25,1.5,1.75,.01,.01,.01,1

Directions: theta_i, phi_i and theta_o, phi_o (theta_s and theta_r mean theta_o), or wi_x .. wo_z. Values: one column
`value`, or r, g, b, or one column a wavelength in nm. A sample with an empty value cell, or with a direction at the
horizon, is masked. A file without a header row, or with other names, is read with `columns`, the names in the file's
order. `# azimuth_observed: false` says that the sample was never turned about its normal, whatever wi
does. Other comment lines are ignored.
"""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import torch

from ..errors import FormatError
from ._columns import DECLARATIONS, Source, check_channels, samples_of, stated_of, value_columns
from ._format import Format
from ._header import ANGLES, header_of, is_direction, split_header
from ._table import line_of, parse_rows
from ._text import brief, head_text, number, text_of
from .samples import Samples, angles

_COMMENT = re.compile(r"^[ \t]*#[ \t]*(\w+)[ \t]*:(.*)$", re.MULTILINE)
_DECLARE_UNIT = (
    "Name the columns theta_i_deg or theta_i_rad, add the line '# angle_unit: degrees' (or radians) to the file, "
    "or pass angle_unit."
)
_DECLARE_QUANTITY = "Add the line '# quantity: brdf' (or another of them) to the file, or pass quantity."


def sniff(head: bytes) -> bool:
    """Whether the first row that is no comment names a direction as only this format does."""
    text = head_text(head)
    found = _header_line(text) if text is not None else None
    if found is None or found[0].split()[0].upper() == "VARS":  # which an ASTM file writes before its names
        return False
    return any(is_direction(name) for name in split_header(found[0])[1])


def read(
    path: Path, quantity: str | None, angle_unit: str | None, columns: str | Sequence[str] | None = None
) -> Samples:
    """The samples of a delimited file, values in 1/sr; FormatError or SamplesError names the line at fault."""
    text = text_of(path)
    found = _header_line(text)
    if found is None:
        raise FormatError("Expected a header row that names the columns, got none. Add it above the data.")
    line, start, first_line = found
    delimiter, names = split_header(line)
    headless = all(number(name) is not None for name in names)
    if columns is None and headless:
        raise FormatError(
            f"Expected a header row that names the columns, got {brief(line.strip())} at line {first_line - 1}. "
            "Add it above the data, or pass columns, such as 'theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value'.",
            field="columns",
        )
    if columns is not None:
        listed = columns.split(",") if isinstance(columns, str) else columns
        given = tuple(str(name).strip().lower() for name in listed)
        if len(given) != len(names):
            raise FormatError(
                f"Expected columns to name {len(names)} columns as line {first_line - 1} has, got {len(given)}. "
                "Name each column of the file once.",
                field="columns",
            )
        names = given
        start, first_line = (start - len(line) - 1, first_line - 1) if headless else (start, first_line)
    header = header_of(delimiter, names)
    body = text[start:]
    rows = parse_rows(body, first_line, header.delimiter, header.names)
    source = Source(
        file=path.name,
        format="csv",
        where=lambda row: f"line {line_of(body, first_line, row)}",
        declare_quantity=_DECLARE_QUANTITY,
        declare_unit=_DECLARE_UNIT,
    )
    return samples_of(header, rows, _declarations(text), quantity, angle_unit, source)


def write_csv(samples: Samples, path: str | Path, comments: Mapping[str, str] | None = None) -> None:
    """None; writes the samples as the BRDF [1/sr] with angles in degrees, so that `read` returns the same ones.

    Numbers are exact but for the angles, rounded to 13 decimals (9e-16 rad, the rounding of the directions
    themselves). `comments` become lines `# key: value` at the top. Raises FormatError for channels or comments that
    would not read back.
    """
    check_channels(samples.channels)
    stated = stated_of(samples)
    for key, text in (comments or {}).items():
        if re.fullmatch(r"\w+", key) is None or key.lower() in DECLARATIONS or re.search(r"[\r\n]", text) is not None:
            raise FormatError(
                f"Expected comments to be one line each under a name of their own, got {key!r}: {text!r}. "
                f"Use a name of letters and digits other than {', '.join(DECLARATIONS)}, and no line break.",
                field="comments",
            )
    theta_phi = (angle for w in (samples.wi, samples.wo) for angle in angles(w))
    columns = {f"{name}_deg": torch.rad2deg(a).round(decimals=13) for name, a in zip(ANGLES, theta_phi, strict=True)}
    columns |= value_columns(samples)
    with Path(path).open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(f"# {key}: {text}\n" for key, text in {**(comments or {}), **stated}.items())
        file.write(",".join(columns) + "\n")
        # repr is the shortest text that reads back as the same float64
        file.writelines(",".join(map(repr, row)) + "\n" for row in torch.stack(list(columns.values()), 1).tolist())


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
        if key in DECLARATIONS and found.setdefault(key, value) != value:
            raise FormatError(
                f"Expected {key} to be declared once, got {brief(found[key])} and {brief(value)}. "
                "Remove the wrong comment line.",
                field=key,
            )
    return found


FORMAT = Format(
    name="csv",
    description="CSV, TSV or columns: a header row with theta_i, phi_i, theta_o, phi_o or wi_x .. wo_z, then values",
    sniff=sniff,
    read=read,
    options=("columns",),
    suffix=".csv",
    write=write_csv,
)
