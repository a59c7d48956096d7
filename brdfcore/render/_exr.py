"""An image as an OpenEXR file: one part, scan lines, three channels of single precision, not compressed.

    magic, version | attributes: name, type, size, value | 0 | place of each line | lines: y, size, B..., G..., R...

All numbers are little-endian; channels stand in the order of their names. Not compressed, since noise hardly
compresses, and a package for it would weigh more than this.
Source: the OpenEXR project, "OpenEXR File Layout".
"""

import struct

import numpy as np
import numpy.typing as npt

MAGIC, VERSION = 20000630, 2
FLOAT = 2  # the type of a channel's numbers
PRIMARIES = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)  # Rec. 709, white D65


def exr(pixels: npt.NDArray[np.float32]) -> bytes:
    """The file's content for linear pixels (H, W, 3) of Rec. 709 primaries."""
    height, width, _ = pixels.shape
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    channels = b"".join(name + b"\0" + struct.pack("<iB3xii", FLOAT, 0, 1, 1) for name in (b"B", b"G", b"R"))
    header = struct.pack("<ii", MAGIC, VERSION)
    for name, kind, value in (
        ("channels", "chlist", channels + b"\0"),
        ("chromaticities", "chromaticities", struct.pack("<8f", *PRIMARIES)),
        ("compression", "compression", b"\0"),
        ("dataWindow", "box2i", window),
        ("displayWindow", "box2i", window),
        ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1.0)),
        ("screenWindowCenter", "v2f", struct.pack("<2f", 0.0, 0.0)),
        ("screenWindowWidth", "float", struct.pack("<f", 1.0)),
    ):
        header += name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value
    header += b"\0"
    size = 12 * width  # bytes of a line's numbers
    first = len(header) + 8 * height
    places = struct.pack(f"<{height}Q", *range(first, first + height * (8 + size), 8 + size))
    lines = np.zeros(height, dtype=[("y", "<i4"), ("size", "<i4"), ("values", "<f4", (3, width))])
    lines["y"], lines["size"] = np.arange(height), size
    lines["values"] = pixels[..., ::-1].transpose(0, 2, 1)
    return header + places + bytes(lines.data)
