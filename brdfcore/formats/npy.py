"""A NumPy array with named fields, `.npy`, for large sets: a table whose fields are named as the columns of a CSV file.

    np.save("large.npy", np.array(rows, dtype=[("theta_i_deg", "f8"), ..., ("r", "f4"), ("g", "f4"), ("b", "f4")]))

Any real type serves. The quantity, and the unit of angles whose names lack _deg or _rad, are declared as arguments. An
array without names is refused: nothing says what its columns are. Nothing in the file is executed (no pickles), and the
size that the header claims is checked before anything is read.
"""

import math
from pathlib import Path

import numpy as np

from ..errors import BrdfError, FormatError
from ._checks import default_where
from ._columns import Source, samples_of
from ._format import Format
from ._header import header_of
from ._size import check_numbers
from ._text import brief
from .samples import Samples

MAGIC = b"\x93NUMPY"
_LONGEST_HEADER = 65_535  # bytes, the most of version 1
_HOW = "Pass it as an argument: the file has no place for it."
_FIELDS = "Save a one-dimensional array with named fields, named as the columns of a CSV file are, or an npz archive."


def sniff(head: bytes) -> bool:
    """Whether the file is a NumPy array."""
    return head.startswith(MAGIC)


def read(path: Path, quantity: str | None, angle_unit: str | None) -> Samples:
    """The samples of a table with named fields, values in 1/sr; FormatError or SamplesError names the field."""
    try:
        array = _load(path)
    except (BrdfError, OSError):
        raise
    except Exception as error:  # NumPy's header parser raises whatever it likes on damaged input
        raise FormatError(
            f"Expected a readable NumPy array, got {type(error).__name__} ({brief(str(error))}). "
            "The file is damaged: save it again with numpy.save."
        ) from error
    names = array.dtype.names or ()
    header = header_of(",", tuple(name.lower() for name in names))
    rows = np.stack([array[name].astype(float) for name in names], -1)
    finite = np.isfinite(rows)
    if not finite.all():
        row, column = (int(k) for k in np.argwhere(~finite)[0])
        raise FormatError(
            f"Expected {names[column]} to be finite, got {rows[row, column]} at {default_where(row)}. "
            "Remove the sample.",
            field=header.names[column],
        )
    source = Source(path.name, "npy", default_where, declare_quantity=_HOW, declare_unit=_HOW)
    return samples_of(header, rows, {}, quantity, angle_unit, source)


def _load(path: Path) -> "np.ndarray[tuple[int], np.dtype[np.void]]":
    with path.open("rb") as file:
        version = np.lib.format.read_magic(file)
        length = int.from_bytes(file.read(2 if version == (1, 0) else 4), "little")
        if length > _LONGEST_HEADER:  # NumPy would make room for it first
            raise FormatError(
                f"Expected a header of at most {_LONGEST_HEADER:,} bytes, got {length:,}. "
                "The file is damaged: save it again with numpy.save."
            )
        file.seek(len(MAGIC) + 2)
        header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = header(file)
        if dtype.names is None or len(shape) != 1 or shape[0] == 0:
            raise FormatError(
                f"Expected the array to be a table with named fields, got {brief(str(dtype))[1:-1]} of shape {shape}. "
                f"{_FIELDS}",
                field="values",
            )
        wrong = [name for name in dtype.names if dtype[name].kind not in "iuf" or dtype[name].itemsize > 8]
        if wrong:
            raise FormatError(
                f"Expected {brief(wrong[0])[1:-1]} to be a field of real numbers, got "
                f"{brief(str(dtype[wrong[0]]))[1:-1]}. Save it as float64.",
                field=wrong[0][:40],
            )
        check_numbers(shape[0] * len(dtype.names))
        claimed, held = math.prod(shape) * dtype.itemsize, path.stat().st_size - file.tell()
        if claimed != held:
            raise FormatError(
                f"Expected the array to hold {claimed:,} bytes as its header says ({shape[0]:,} rows of "
                f"{dtype.itemsize}), got {held:,}. The file is damaged or truncated: fetch it again."
            )
        return np.fromfile(file, dtype=dtype, count=shape[0])


FORMAT = Format(
    name="npy",
    description="NumPy array with named fields: the columns of a CSV file, as numpy.save writes a structured array",
    sniff=sniff,
    read=read,
)
