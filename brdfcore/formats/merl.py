"""The MERL database's `.binary`: an isotropic BRDF table over Rusinkiewicz's half and difference angles, R, G, B.

    int32 90, 90, 180                      bins of theta_h, theta_d, phi_d, all little-endian
    float64 R plane, G plane, B plane      theta_h slowest, phi_d fastest; stored / (1, 1.15, 1.66) * 1500
    theta_h = (i/90)^2 90 deg, theta_d = j deg, phi_d = k deg; phi_d spans 180 deg, by reciprocity

A sample stands at its bin's centre (i + 1/2 and so on). With Ry a turn about y and the half vector at phi_h = 0:

    wi = Ry(theta_h) d,  wo = Ry(theta_h) d',  d and d' at (theta_d, phi_d) and (theta_d, phi_d + 180 deg)

which inverts std_coords_to_half_diff_coords of the database's own BRDFRead.cpp. wi's azimuth varies with the bin,
yet the sphere that was measured never showed an azimuth of its material, so azimuth_observed is False.
cell = sin theta_h sin theta_d cos theta_d times the bin's widths in theta_h, theta_d, phi_d [rad^3].
Source: Matusik et al., ACM Transactions on Graphics 22(3), 2003; Rusinkiewicz, Rendering Techniques 1998.
"""

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..errors import FormatError
from ._assemble import HORIZON
from ._declared import declared
from ._format import Format
from .samples import QUANTITIES, Masked, Samples

SHAPE = (90, 90, 180)
SCALE = (1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0)
_NEGATIVE = "value is negative, which MERL uses for invalid bins"
_BELOW = "a direction at the bin's centre is at or below the horizon"

Array = npt.NDArray[np.float64]


def sniff(head: bytes) -> bool:
    """Whether the file starts with MERL's three dimensions."""
    return head[:12] == np.array(SHAPE, dtype="<i4").tobytes()


def stored_values(path: Path) -> Array:
    """What a MERL file stores, (3, bins), negative where it is invalid; FormatError where it is not whole."""
    bins = math.prod(SHAPE)
    expected, actual = 12 + 3 * bins * 8, path.stat().st_size
    with path.open("rb") as file:
        head = file.read(12)
        if not sniff(head):
            got = " ".join(str(n) for n in np.frombuffer(head[: len(head) // 4 * 4], dtype="<i4"))
            raise FormatError(
                f"Expected a MERL file to start with the dimensions {' '.join(map(str, SHAPE))}, "
                f"got {got or 'nothing'}. Check that this is a MERL .binary file."
            )
        if actual != expected:
            raise FormatError(
                f"Expected a MERL file to hold {expected:,} bytes, got {actual:,}. "
                f"It is {'truncated' if actual < expected else 'too long'}: fetch it again."
            )
        stored = np.fromfile(file, dtype="<f8", count=3 * bins).reshape(3, bins)
    bad = ~np.isfinite(stored)
    if bad.any():
        plane, flat = (int(k) for k in np.argwhere(bad)[0])
        at = ", ".join(str(k) for k in np.unravel_index(flat, SHAPE))
        raise FormatError(
            f"Expected MERL values to be finite, got {stored[plane, flat]} in the {('red', 'green', 'blue')[plane]} "
            f"plane at bin ({at}). The file is damaged: fetch it again.",
            field="values",
        )
    return stored


def read(path: Path, quantity: str | None, angle_unit: str | None) -> Samples:
    """The valid bins of a MERL file as samples, values in 1/sr; FormatError where it is not whole."""
    declared("quantity", QUANTITIES, "brdf", quantity, "")
    stored = stored_values(path)
    wi, wo, cell = grid()
    negative = (stored < 0).any(0)
    below = ~negative & ((wi[:, 2] <= HORIZON) | (wo[:, 2] <= HORIZON))
    kept = np.flatnonzero(~(negative | below))
    masked = (Masked(_NEGATIVE, int(negative.sum())), Masked(_BELOW, int(below.sum())))
    if len(kept) == 0:
        raise FormatError(
            f"Expected a MERL file to hold at least one valid bin, got {len(wi):,} invalid ones. "
            "Check that it is whole.",
            field="values",
        )
    return Samples(
        wi[kept],
        wo[kept],
        stored.T[kept] * SCALE,
        ("r", "g", "b"),
        cell=cell[kept],
        masked=[m for m in masked if m.count],
        source=path.name,
        format="merl",
        azimuth_observed=False,
    )


def grid() -> tuple[Array, Array, Array]:
    """Directions wi, wo (bins, 3) at the centres of all bins, and their measure `cell` (bins,), in the file's order."""
    edges = [
        (np.arange(SHAPE[0] + 1) / SHAPE[0]) ** 2 * math.pi / 2,
        np.arange(SHAPE[1] + 1) / SHAPE[1] * math.pi / 2,
        np.arange(SHAPE[2] + 1) / SHAPE[2] * math.pi,
    ]
    centres = [
        ((np.arange(SHAPE[0]) + 0.5) / SHAPE[0]) ** 2 * math.pi / 2,
        (np.arange(SHAPE[1]) + 0.5) / SHAPE[1] * math.pi / 2,
        (np.arange(SHAPE[2]) + 0.5) / SHAPE[2] * math.pi,
    ]
    theta_h, theta_d, phi_d = (a.ravel() for a in np.meshgrid(*centres, indexing="ij"))
    widths = [a.ravel() for a in np.meshgrid(*(np.diff(e) for e in edges), indexing="ij")]
    cell = np.sin(theta_h) * np.sin(theta_d) * np.cos(theta_d) * math.prod(widths)
    x, y, z = np.sin(theta_d) * np.cos(phi_d), np.sin(theta_d) * np.sin(phi_d), np.cos(theta_d)
    c, s = np.cos(theta_h), np.sin(theta_h)
    wi = np.stack([c * x + s * z, y, -s * x + c * z], -1)
    wo = np.stack([-c * x + s * z, -y, s * x + c * z], -1)
    return wi, wo, cell


def bins(wi: Array, wo: Array) -> npt.NDArray[np.intp]:
    """The bin, counted in the file's order, that holds each pair of directions (N, 3), as BRDFRead.cpp finds it."""
    places = (place.astype(int) for place in coordinates(wi, wo))
    i, j, k = (np.clip(place, 0, n - 1) for place, n in zip(places, SHAPE, strict=True))
    found: npt.NDArray[np.intp] = (i * SHAPE[1] + j) * SHAPE[2] + k
    return found


def coordinates(wi: Array, wo: Array) -> tuple[Array, Array, Array]:
    """The place of each pair of directions (N, 3) along the table's axes, in bins: k to k + 1 is within bin k."""
    half = wi + wo
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    sine = np.hypot(half[:, 0], half[:, 1])
    theta_h = np.arctan2(sine, half[:, 2])
    # wi in the frame of the half vector: turned by -phi_h about z, then by -theta_h about y
    cosine = np.divide(half[:, 0], sine, out=np.ones_like(sine), where=sine > 0)
    sine_phi = np.divide(half[:, 1], sine, out=np.zeros_like(sine), where=sine > 0)
    x, y = wi[:, 0] * cosine + wi[:, 1] * sine_phi, wi[:, 1] * cosine - wi[:, 0] * sine_phi
    x, z = x * half[:, 2] - wi[:, 2] * sine, x * sine + wi[:, 2] * half[:, 2]
    theta_d, phi_d = np.arctan2(np.hypot(x, y), z), np.arctan2(y, x) % math.pi
    return (
        np.sqrt(theta_h / (math.pi / 2)) * SHAPE[0],
        theta_d / (math.pi / 2) * SHAPE[1],
        phi_d / math.pi * SHAPE[2],
    )


FORMAT = Format(
    name="merl",
    description="MERL .binary: int32 90, 90, 180, then R, G, B planes of float64",
    sniff=sniff,
    read=read,
)
