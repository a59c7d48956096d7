"""What Arrow and Parquet files share: a table whose columns are named as those of a CSV file are.

pyarrow reads and writes them. It is an extra of this package (170 MB installed, more than all else but torch), so it is
loaded when such a file is met, and a sentence says how to get it where it is missing. Its own errors become sentences.
"""

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import torch

from ..errors import BrdfError, FormatError
from ._checks import default_where
from ._columns import DECLARATIONS, Source, columns_of, samples_of, stated_of
from ._header import header_of
from ._text import brief
from .samples import Samples

_HOW = "Add it to the schema's metadata under this key, or pass it as an argument."


def pyarrow(module: str) -> Any:
    """The module pyarrow or one of its own; FormatError says how to install it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise FormatError(
            "Expected pyarrow to be installed, as Arrow and Parquet files need it, got none. "
            "Install it with: pip install 'brdfcore[arrow]'.",
            field="format",
        ) from error


def check_schema(schema: Any) -> None:
    """Raise FormatError where a column is no number or its name is unknown, before any of its data are read."""
    types = pyarrow("pyarrow").types
    for field in schema:
        if not (types.is_integer(field.type) or types.is_floating(field.type)):
            raise FormatError(
                f"Expected {brief(field.name)[1:-1]} to be a column of real numbers, got "
                f"{brief(str(field.type))[1:-1]}. Save it as double.",
                field=field.name[:40],
            )
    header_of(",", tuple(name.lower() for name in schema.names))


def damaged(kind: str, error: Exception) -> FormatError:
    """The error for a file that pyarrow cannot read."""
    first = (str(error).splitlines() or [""])[0]
    return FormatError(
        f"Expected a readable {kind} file, got {type(error).__name__} ({brief(first)}). "
        "The file is damaged or truncated: fetch it again."
    )


def samples_from_table(table: Any, path: Path, kind: str, quantity: str | None, angle_unit: str | None) -> Samples:
    """The samples of an Arrow table whose schema has been checked, values in 1/sr; a null is an empty cell."""
    if table.num_rows == 0:
        raise FormatError("Expected at least one row of data, got none. Check that the file is whole.")
    header = header_of(",", tuple(name.lower() for name in table.column_names))
    rows = np.empty((table.num_rows, table.num_columns))
    for index, (name, column) in enumerate(zip(table.column_names, table.columns, strict=True)):
        cells = column.cast("double", safe=False)
        rows[:, index] = cells.to_numpy()
        good = np.isfinite(rows[:, index]) | np.asarray(cells.is_null())
        if not good.all():
            row = int(good.argmin())
            raise FormatError(
                f"Expected {name} to be finite, got {rows[row, index]} at {default_where(row)}. "
                "A value that was not measured is null.",
                field=header.names[index],
            )
    metadata = table.schema.metadata or {}
    stated = {key: _word(metadata[key.encode()], key) for key in DECLARATIONS if key.encode() in metadata}
    source = Source(path.name, kind, default_where, declare_quantity=_HOW, declare_unit=_HOW)
    return samples_of(header, rows, stated, quantity, angle_unit, source)


def table_of(samples: Samples) -> Any:
    """The samples as an Arrow table, exact; FormatError for channels whose names would not read back."""
    arrays = {name: column.to(torch.float64).numpy() for name, column in columns_of(samples).items()}
    return pyarrow("pyarrow").table(arrays).replace_schema_metadata(stated_of(samples))


def _word(value: bytes, key: str) -> str:
    try:
        return value.decode().strip().lower()
    except UnicodeDecodeError as error:
        raise FormatError(f"Expected {key} to be text, got {value[:20]!r}. Correct the metadata.", field=key) from error


def guarded(kind: str, error: Exception) -> Exception:
    """The error to raise in place of one met while reading: our own and the system's as they are, others as damage."""
    system = isinstance(error, OSError) and error.errno is not None  # pyarrow's own OSErrors have no number
    return error if isinstance(error, BrdfError) or system else damaged(kind, error)
