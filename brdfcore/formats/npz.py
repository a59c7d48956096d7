"""NumPy archives, for large sets: one array a key.

    wi, wo                          (N, 3) unit vectors; or
    theta_i, phi_i, theta_o, phi_o  (N,) with angle_unit, "degrees" or "radians", as a key or an argument
    values                          (N, C) or (N,)
    quantity                        "brdf", "brdf_cos" or "reflectance_factor", as a key or an argument
    channels, sigma, weight, cell   optional: C names; like values; (N,); (N,)
    azimuth_observed                optional: "true" or "false", as Samples takes it

Nothing in the archive is executed (no pickles), and sizes are checked in the zip's directory and in each array's
header before anything is unpacked: a small archive can hold gigabytes of zeros, and a header can claim any shape.
"""

import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..errors import BrdfError, FormatError, SamplesError
from ._assemble import from_columns
from ._checks import default_where
from ._columns import TRUTH, stated_of
from ._declared import declared
from ._format import Format
from ._header import ANGLES
from ._size import check_numbers
from ._text import brief
from .samples import ANGLE_UNITS, QUANTITIES, Samples, SamplesKeywords

MAX_UNCOMPRESSED_BYTES = 2 * 2**30  # of all arrays together
_WORDS = ("quantity", "angle_unit", "azimuth_observed")
_TEXTS = (*_WORDS, "channels")
_MOST_WORDS = 10_000  # channels; a spectrometer has some hundreds
_NUMBERS = ("wi", "wo", *ANGLES, "values", "sigma", "weight", "cell")
_HOW = "Add it to the archive under this key, or pass it as an argument."

Array = npt.NDArray[Any]


def sniff(head: bytes) -> bool:
    """Whether the file is a zip archive whose first member is a NumPy array."""
    length = int.from_bytes(head[26:28], "little")
    return head[:4] == b"PK\x03\x04" and head[30 : 30 + length].endswith(b".npy")


def read(path: Path, quantity: str | None, angle_unit: str | None) -> Samples:
    """The samples of an npz archive, values in 1/sr; FormatError or SamplesError names the key at fault."""
    arrays = _unpack(path)
    stated = {name: str(arrays[name][()]) for name in _WORDS if name in arrays}
    measured_quantity = declared("quantity", QUANTITIES, stated.get("quantity"), quantity, _HOW)
    directions = {name: arrays[name] for name in ("wi", "wo", *ANGLES) if name in arrays}
    if list(directions) not in (["wi", "wo"], list(ANGLES)):
        raise FormatError(
            "Expected the archive to hold either wi and wo, or theta_i, phi_i, theta_o and phi_o, "
            f"got {', '.join(directions) or 'no directions'}. Save one of the two sets.",
            field="wi",
        )
    if "values" not in arrays:
        raise FormatError("Expected the archive to hold values, got none. Save them under this key.", field="values")
    for name in ("values", "sigma"):
        if name in arrays and arrays[name].ndim == 1:
            arrays[name] = arrays[name][:, None]
    values = arrays["values"]
    if values.ndim != 2 or values.size == 0:
        raise SamplesError(
            f"Expected values to be of shape (N, C) or (N,) with at least one sample, got {values.shape}. "
            "Save one row a sample.",
            field="values",
        )
    for name in _NUMBERS:
        if name in arrays:
            shape = {"wi": (len(values), 3), "wo": (len(values), 3), "values": values.shape, "sigma": values.shape}
            _require(name, arrays[name], shape.get(name, (len(values),)))
    if "theta_i" in directions:
        unit = declared("angle_unit", ANGLE_UNITS, stated.get("angle_unit"), angle_unit, _HOW)
        directions = {name: np.deg2rad(a) if unit == "degrees" else a for name, a in directions.items()}
    keywords: SamplesKeywords = {"quantity": measured_quantity, "source": path.name, "format": "npz"}
    if "channels" in arrays:
        keywords["channels"] = tuple(str(name) for name in arrays["channels"].ravel())
    if "sigma" in arrays:
        keywords["sigma"] = arrays["sigma"]
    if "weight" in arrays:
        keywords["weight"] = arrays["weight"]
    if "cell" in arrays:
        keywords["cell"] = arrays["cell"]
    if "azimuth_observed" in stated:
        told = declared("azimuth_observed", TRUTH, stated["azimuth_observed"], None, _HOW)
        keywords["azimuth_observed"] = told == "true"
    return from_columns(directions, values, **keywords)


def _require(name: str, array: Array, shape: tuple[int, ...]) -> None:
    if array.shape != shape:
        raise SamplesError(
            f"Expected {name} to be of shape {shape} as values has {shape[0]} rows, got {array.shape}. "
            "Save one row a sample.",
            field=name,
        )
    finite = np.isfinite(array)
    if not finite.all():
        row = int(np.argwhere(~finite)[0, 0])
        raise SamplesError(
            f"Expected {name} to be finite, got {array[row]} at {default_where(row)}. Remove the sample.", field=name
        )


def _unpack(path: Path) -> dict[str, Array]:
    """All arrays by key: float64, or text for the keys that are text."""
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
            _check_directory([member.filename for member in members], sum(member.file_size for member in members))
            check_numbers(sum(_count(archive, member) for member in members))
            return {member.filename.removesuffix(".npy"): _load(archive, member) for member in members}
    except BrdfError:
        raise
    except Exception as error:  # the zip, inflate and header parsers raise whatever they like on damaged input
        raise FormatError(
            f"Expected a readable NumPy archive, got {type(error).__name__} ({brief(str(error))}). "
            "The file is damaged, encrypted or beyond the memory: save it again with numpy.savez."
        ) from error


def _check_directory(names: list[str], size: int) -> None:
    known = {f"{name}.npy" for name in (*_TEXTS, *_NUMBERS)}
    for index, name in enumerate(names):
        key = name.removesuffix(".npy")
        if name not in known:
            raise FormatError(
                f"Expected the archive's keys to be among {', '.join((*_NUMBERS, *_TEXTS))}, "
                f"got {brief(key)}. Remove or rename it.",
                field=key[:40],
            )
        if name in names[:index]:
            raise FormatError(
                f"Expected every key of the archive to be there once, got {key!r} twice. Save the archive again.",
                field=key,
            )
    if size > MAX_UNCOMPRESSED_BYTES:
        raise FormatError(
            f"Expected an archive of at most {MAX_UNCOMPRESSED_BYTES:,} bytes unpacked, got {size:,}. "
            "Split it, or keep fewer samples."
        )


def _count(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> int:
    """How many numbers an array holds, after its header has been found to fit the member's size."""
    name = member.filename.removesuffix(".npy")
    with archive.open(member) as file:
        version = np.lib.format.read_magic(file)
        header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = header(file)
        kinds = "U" if name in _TEXTS else "iuf"
        if dtype.kind not in kinds or (dtype.kind == "f" and dtype.itemsize > 8):
            rule, remedy = ("text", "str") if name in _TEXTS else ("real numbers", "float64")
            raise FormatError(
                f"Expected {name} to be an array of {rule}, got {brief(str(dtype))[1:-1]}. Save it as {remedy}.",
                field=name,
            )
        held = member.file_size - file.tell()
        if math.prod(shape) * dtype.itemsize != held:
            raise FormatError(
                f"Expected {name} to hold {math.prod(shape) * dtype.itemsize:,} bytes as its header says "
                f"(shape {shape}, {dtype}), got {held:,}. The file is damaged: save it again.",
                field=name,
            )
    count = math.prod(shape)
    if name in _TEXTS and count > _MOST_WORDS:
        raise FormatError(
            f"Expected {name} to be at most {_MOST_WORDS:,} words, got {count:,}. Save one name a channel.", field=name
        )
    return 0 if name in _TEXTS else count


def _load(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> Array:
    """One array whose header has been checked."""
    name = member.filename.removesuffix(".npy")
    with archive.open(member) as file:
        array: Array = np.lib.format.read_array(file, allow_pickle=False)
    if name in _WORDS and array.size != 1:
        raise FormatError(
            f"Expected {name} to be one word, got an array of shape {array.shape}. Save it as a str.", field=name
        )
    return array.reshape(()) if name in _WORDS else array if name in _TEXTS else array.astype(float)


def write_npz(samples: Samples, path: Path) -> None:
    """None; writes all that `read` gives back, with any channel names, bit for bit."""
    arrays: dict[str, Any] = {name: np.array(word) for name, word in stated_of(samples).items()}
    arrays["channels"] = np.array(samples.channels)
    for name in ("wi", "wo", "values", "sigma", "weight", "cell"):
        array = getattr(samples, name)
        if array is not None:
            arrays[name] = array.numpy()
    with path.open("wb") as file:  # given a name, NumPy would add a suffix
        np.savez_compressed(file, **arrays)


FORMAT = Format(
    name="npz",
    description="NumPy archive: wi and wo, or theta_i, phi_i, theta_o and phi_o; values; channels, sigma, weight",
    sniff=sniff,
    read=read,
    suffix=".npz",
    write=write_npz,
)
