"""Samples from numbers in named columns, whatever file they stood in: CSV, NumPy, Arrow and Parquet share it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import torch

from ..errors import FormatError
from ._assemble import from_columns
from ._checks import Where
from ._declared import declared
from ._header import ANGLES, VECTORS, Header, value_channels
from ._text import brief, brief_list
from .samples import ANGLE_UNITS, QUANTITIES, Samples, SamplesKeywords

DECLARATIONS = ("quantity", "angle_unit", "azimuth_observed")
TRUTH = ("true", "false")

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Source:
    """Where columns come from: names for Samples and for errors, and how the user adds what is missing there."""

    file: str
    format: str
    where: Where
    declare_quantity: str
    declare_unit: str


def samples_of(
    header: Header, rows: Array, stated: Mapping[str, str], quantity: str | None, angle_unit: str | None, source: Source
) -> Samples:
    """Samples from rows (N, columns), in which NaN is an empty cell, and from what file and caller declare.

    Raises FormatError where something is undeclared or a cell that must not be is empty, SamplesError for a bad row.
    """
    measured_quantity = declared("quantity", QUANTITIES, stated.get("quantity"), quantity, source.declare_quantity)
    units = {name: _unit(name, header, stated.get("angle_unit"), angle_unit, source) for name in header.units}
    empty = np.isnan(rows)
    measured = ~np.any(empty[:, header.values], axis=-1, keepdims=True)
    empty[:, header.values] = False
    empty[:, header.sigma] &= measured  # the row is masked, and its sigma with it
    if empty.any():
        row, column = (int(k) for k in np.argwhere(empty)[0])
        name = header.names[column]
        raise FormatError(
            f"Expected {name} at {source.where(row)} to be a number, got an empty cell. "
            "Fill it in or remove the row; only a value may be empty, and sigma with it.",
            field=name,
        )
    columns = {name: rows[:, column] for name, column in header.directions.items()}
    if units:
        directions = {name: np.deg2rad(columns[name]) if units[name] == "degrees" else columns[name] for name in ANGLES}
    else:
        directions = {w: np.stack([columns[name] for name in VECTORS if name.startswith(w)], -1) for w in ("wi", "wo")}
    told = stated.get("azimuth_observed")
    keywords: SamplesKeywords = {
        "channels": header.channels,
        "quantity": measured_quantity,
        "source": source.file,
        "format": source.format,
        "where": source.where,
        "azimuth_observed": None if told is None else declared("azimuth_observed", TRUTH, told, None, "") == "true",
    }
    if header.sigma:
        keywords["sigma"] = np.broadcast_to(rows[:, header.sigma], (len(rows), len(header.channels)))
    if "weight" in header.extras:
        keywords["weight"] = rows[:, header.extras["weight"]]
    if "cell" in header.extras:
        keywords["cell"] = rows[:, header.extras["cell"]]
    return from_columns(directions, rows[:, header.values], **keywords)


def columns_of(samples: Samples) -> dict[str, torch.Tensor]:
    """The samples' exact numbers by column name, each (N,); FormatError for channels that would not read back."""
    check_channels(samples.channels)
    columns = dict(zip(VECTORS, (*samples.wi.unbind(1), *samples.wo.unbind(1)), strict=True))
    return columns | value_columns(samples)


def check_channels(channels: tuple[str, ...]) -> None:
    """Raise FormatError where channels cannot be columns of a table, as their names would not read back."""
    try:
        value_channels(channels)
    except FormatError as error:
        raise FormatError(
            "Expected channels to be value, or r, g, b, or wavelengths in nm for a table, "
            f"got {brief_list(channels)}. Write an .npz, which takes any names.",
            field="channels",
        ) from error


def value_columns(samples: Samples) -> dict[str, torch.Tensor]:
    """Values, sigma, weight and cell by column name, each (N,)."""
    columns = dict(zip(samples.channels, samples.values.unbind(1), strict=True))
    if samples.sigma is not None:
        single = len(samples.channels) == 1
        names = ["sigma"] if single else [f"sigma_{channel}" for channel in samples.channels]
        columns |= dict(zip(names, samples.sigma.unbind(1), strict=True))
    columns |= {"weight": samples.weight} if samples.weight is not None else {}
    return columns | ({"cell": samples.cell} if samples.cell is not None else {})


def stated_of(samples: Samples) -> dict[str, str]:
    """What a file states of samples written to it."""
    told = samples.azimuth_declared
    return {"quantity": "brdf"} | ({} if told is None else {"azimuth_observed": str(told).lower()})


def _unit(name: str, header: Header, in_file: str | None, argument: str | None, source: Source) -> str:
    """The unit of one angle: by its name, by what the file declares or by the argument, which must agree."""
    in_name = header.units[name]
    if in_name is not None and in_file is not None and in_name != in_file:
        raise FormatError(
            f"Expected angle_unit to be {in_name!r} as the column {name} has it, got {brief(in_file)} in a comment. "
            "Correct one of them.",
            field="angle_unit",
        )
    return declared("angle_unit", ANGLE_UNITS, in_name or in_file, argument, source.declare_unit)
