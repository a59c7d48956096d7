r"""The container of RGL's `.bsdf` files: named arrays of numbers.

    12 bytes "tensor_file\\0", 2 bytes version 1.0, uint32 number of fields; then for each field
    uint16 length of the name, the name, uint16 dimensions, uint8 type, uint64 offset of the data, uint64 a dimension

All little-endian. Source: Dupuy and Jakob 2018, "An adaptive parameterization for efficient material acquisition and
rendering", the authors' brdf-loader.
"""

import math
import struct

import numpy as np
import numpy.typing as npt

from ..errors import FormatError

MAGIC = b"tensor_file\0"
_TYPES = {1: "u1", 2: "i1", 3: "<u2", 4: "<i2", 5: "<u4", 6: "<i4", 7: "<u8", 8: "<i8", 9: "<f2", 10: "<f4", 11: "<f8"}
_MOST_FIELDS = 1000
_MOST_DIMENSIONS = 16


def tensors(content: bytes) -> dict[str, npt.NDArray[np.generic]]:
    """The arrays of a file by name, as views of its content; FormatError where it is damaged."""
    if content[:12] != MAGIC or content[12:14] != b"\1\0":
        raise FormatError(
            f"Expected a tensor file to start with 'tensor_file' and version 1.0, got {content[:14]!r}. "
            "Check that this is a .bsdf file of the RGL database."
        )
    found: dict[str, npt.NDArray[np.generic]] = {}
    try:
        (count,) = struct.unpack_from("<I", content, 14)
        at = 18
        if count > _MOST_FIELDS:
            raise _damaged(f"{count} fields")
        for _ in range(count):
            (length,) = struct.unpack_from("<H", content, at)
            name = content[at + 2 : at + 2 + length].decode("ascii")
            dimensions, kind, offset = struct.unpack_from("<HBQ", content, at + 2 + length)
            at += 13 + length
            if kind not in _TYPES or dimensions > _MOST_DIMENSIONS:
                raise _damaged(f"type {kind} of {dimensions} dimensions for {name[:20]!r}")
            shape = struct.unpack_from(f"<{dimensions}Q", content, at)
            at += 8 * dimensions
            size = math.prod(shape)
            if offset + size * np.dtype(_TYPES[kind]).itemsize > len(content):
                raise _damaged(f"{name[:20]!r} of shape {shape} beyond the end of its {len(content):,} bytes")
            found[name] = np.frombuffer(content, _TYPES[kind], size, offset).reshape(shape)
    except (struct.error, UnicodeDecodeError) as error:
        raise _damaged(f"{error}") from error
    return found


def _damaged(got: str) -> FormatError:
    return FormatError(f"Expected a tensor file to list arrays that it holds, got {got}. Fetch it again.")
