"""A small file in the layout of the RGL database, as bytes."""

import struct

import numpy as np

TYPES = {"uint8": 1, "float32": 10}


def rgl_arrays(*, azimuths: tuple[float, ...] = (0.0,), wavelengths: tuple[float, ...] = ()) -> dict[str, np.ndarray]:
    """A smooth made-up material: RGB, or one value a wavelength; isotropic where it has one azimuth."""
    rng = np.random.default_rng(4)
    elevations = np.array([0.0, 0.4, 0.9, 1.3, np.pi / 2], "f4")
    incidences = (len(azimuths), len(elevations))
    channels = len(wavelengths) or 3
    arrays = {
        "description": np.frombuffer(b"made for the tests", "u1"),
        "phi_i": np.array(azimuths, "f4"),
        "theta_i": elevations,
        "sigma": (0.3 + 0.7 * np.linspace(1, 0, 8) * np.ones((2, 1))).astype("f4"),
        "ndf": (0.05 + np.linspace(1, 0, 8) ** 2 * np.ones((2, 1))).astype("f4"),
        "vndf": (0.2 + rng.uniform(0, 1, (*incidences, 9, 8))).astype("f4"),
        "luminance": (0.2 + rng.uniform(0, 1, (*incidences, 6, 6))).astype("f4"),
        "jacobian": np.array([1], "u1"),
    }
    values = (0.1 + rng.uniform(0, 1, (*incidences, channels, 6, 6))).astype("f4")
    if wavelengths:
        return arrays | {"wavelengths": np.array(wavelengths, "f4"), "spectra": values}
    return arrays | {"rgb": values}


def tensor_file(arrays: dict[str, np.ndarray]) -> bytes:
    """The arrays in the database's container."""
    head = 18 + sum(13 + len(name) + 8 * array.ndim for name, array in arrays.items())
    table, data = b"", b""
    for name, array in arrays.items():
        offset = head + len(data)
        table += struct.pack("<H", len(name)) + name.encode()
        table += struct.pack("<HBQ", array.ndim, TYPES[str(array.dtype)], offset) + struct.pack(
            f"<{array.ndim}Q", *array.shape
        )
        data += array.tobytes()
    return b"tensor_file\0\1\0" + struct.pack("<I", len(arrays)) + table + data


def rgl_bytes() -> bytes:
    """The material as an isotropic RGB file."""
    return tensor_file(rgl_arrays())
