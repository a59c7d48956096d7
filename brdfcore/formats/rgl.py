"""The RGL material database's `.bsdf`: a BRDF over an adaptive parameterisation, in RGB or over wavelengths.

    f(wi, wo) cos theta_o = S(u; wi) D(h) / (4 sigma(wi)),  u = the inverse of the warp by vndf(. ; wi) at h    [1/sr]

    description  text                             phi_i (P), theta_i (T)   angles of incidence, the nodes of wi [rad]
    ndf, sigma   D and the projected area, over theta and phi               vndf (P, T, H, W)  density of h seen from wi
    luminance (P, T, h, w), and rgb (P, T, 3, h, w), or spectra (P, T, n, h, w) with wavelengths (n): S over u
    jacobian     whether D / (4 sigma) applies

On the unit square a direction is (sqrt(2 theta / pi), (phi + pi) / (2 pi)), phi of the half vector relative to wi if
the material is isotropic (P <= 2). wi is the file's incident direction. `read` yields the samples at the file's own
nodes: at each wi, the directions of its w x h grid on u; so they crowd where the material reflects. Nodes with a
direction at or below the horizon are masked. Values may be slightly negative, as measured.
Source: Dupuy and Jakob 2018, "An adaptive parameterization for efficient material acquisition and rendering", ACM
Transactions on Graphics 37(6), and the authors' brdf-loader. Departure: double precision.
"""

import itertools
import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..errors import FormatError
from ._declared import declared
from ._format import Format
from ._size import check_numbers
from ._tensors import MAGIC, tensors
from ._warp import Corners, Table, Warp
from .samples import QUANTITIES, Masked, Samples

Array = npt.NDArray[np.float64]

_HORIZON = 1e-6  # cosine; angles of single precision put the horizon 4e-8 rad above or below itself
_BELOW = "a direction at the grid's node is at or below the horizon"
_FIELDS = {"phi_i": 1, "theta_i": 1, "ndf": 2, "sigma": 2, "vndf": 4, "luminance": 4, "jacobian": 1}


@dataclass(frozen=True)
class Rgl:
    """The tables of a file; directions are arrays (N, 3)."""

    phi_i: Array
    theta_i: Array
    ndf: Table
    sigma: Table
    vndf: Warp
    luminance: Warp
    values: Array  # (P T, C, h, w)
    channels: tuple[str, ...]
    jacobian: bool

    @property
    def isotropic(self) -> bool:
        """Whether the file knows one azimuth of the sample only."""
        return len(self.phi_i) <= 2

    @cached_property
    def folds(self) -> int:
        """In how many parts of the circle the azimuth of incidence is folded: 1, 2 or 4."""
        return 1 if self.isotropic else round(2 * math.pi / float(self.phi_i[-1] - self.phi_i[0]))

    def folded(self, wi: Array, wo: Array) -> tuple[Array, Array]:
        """The directions mirrored so that wi's azimuth is one that was measured."""
        if self.folds < 2:
            return wi, wo
        y = np.where(wi[:, 1] > 0, -1.0, 1.0)
        x = np.where(wi[:, 0] > 0, -1.0, 1.0) if self.folds == 4 else y
        mirror = np.stack([x, y, np.ones_like(x)], -1)
        return wi * mirror, wo * mirror

    def corners(self, wi: Array) -> Corners:
        """Where wi lies between the measured angles of incidence."""
        return Corners.between([self.phi_i, self.theta_i], [_azimuth(wi), _elevation(wi)])

    def half_square(self, wi: Array, wo: Array) -> tuple[Array, Array]:
        """The place of the half vector on the unit square."""
        half = wi + wo
        half /= np.linalg.norm(half, axis=-1, keepdims=True)
        phi = _azimuth(half) - (_azimuth(wi) if self.isotropic else 0.0)
        return np.sqrt(_elevation(half) * 2 / math.pi), ((phi + math.pi) / (2 * math.pi)) % 1.0

    def scale(self, x: Array, y: Array, wi: Array) -> Array:
        """D / (4 sigma) (N,) at a place of the half vector, 1 where the file says so."""
        if not self.jacobian:
            return np.ones(len(x))
        only = Corners(np.zeros((len(x), 1), dtype=np.intp), np.ones((len(x), 1)))
        seen = self.sigma(np.sqrt(_elevation(wi) * 2 / math.pi), (_azimuth(wi) + math.pi) / (2 * math.pi), only)
        return self.ndf(x, y, only) / (4 * seen)

    def f(self, wi: Array, wo: Array) -> Array:
        """The BRDF (N, C) [1/sr] for directions above the horizon."""
        wi, wo = self.folded(wi, wo)
        at = self.corners(wi)
        x, y = self.half_square(wi, wo)
        u, v, _ = self.vndf.invert(x, y, at)
        columns = [Table(self.values[:, channel])(u, v, at) for channel in range(self.values.shape[1])]
        return np.stack(columns, -1) * (self.scale(x, y, wi) / wo[:, 2])[:, None]

    def pdf(self, given: Array, drawn: Array) -> Array:
        """The density (N,) [1/sr] with which `sample` draws a direction for the given one."""
        given, drawn = self.folded(given, drawn)
        at = self.corners(given)
        x, y = self.half_square(given, drawn)
        u, v, density = self.vndf.invert(x, y, at)
        half = given + drawn
        half /= np.linalg.norm(half, axis=-1, keepdims=True)
        cosine = (half * given).sum(-1)
        # the square's measure a solid angle of h, and dh / dw; floored as the authors floor it
        jacobian = np.maximum(2 * math.pi**2 * x * np.hypot(half[:, 0], half[:, 1]), 1e-6) * 4 * cosine
        found: Array = density * self.luminance.density(u, v, at) / jacobian
        return found

    def sample(self, given: Array, u: Array, v: Array) -> Array:
        """Directions (N, 3) for a given one above the horizon and u, v in [0, 1]; some lie below the horizon."""
        folded, _ = self.folded(given, given)
        at = self.corners(folded)
        s, t, _ = self.luminance.sample(u, v, at)
        x, y, _ = self.vndf.sample(s, t, at)
        drawn = self.outgoing(folded, x, y)
        return self.folded(given, drawn)[1] if self.folds > 1 else drawn

    def outgoing(self, wi: Array, x: Array, y: Array) -> Array:
        """The direction that mirrors wi at the half vector of a place on the unit square, (N, 3)."""
        theta, phi = x * x * (math.pi / 2), (2 * y - 1) * math.pi + (_azimuth(wi) if self.isotropic else 0.0)
        half = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
        mirrored: Array = 2 * (half * wi).sum(-1, keepdims=True) * half - wi
        return mirrored


def sniff(head: bytes) -> bool:
    """Whether the file is a tensor file."""
    return head[: len(MAGIC)] == MAGIC


def read(path: Path, quantity: str | None, angle_unit: str | None) -> Samples:
    """The file's values at its own nodes, in 1/sr; FormatError where it is not whole."""
    declared("quantity", QUANTITIES, "brdf", quantity, "")
    tables = load(path)
    height, width = tables.values.shape[2:]
    u, v = (a.ravel() for a in np.meshgrid(np.arange(width) / (width - 1), np.arange(height) / (height - 1)))
    incident, outgoing, values = [], [], []
    for number, (phi, theta) in enumerate(itertools.product(tables.phi_i.tolist(), tables.theta_i.tolist())):
        direction = [math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)]
        wi = np.tile(np.array(direction), (len(u), 1))
        at = Corners(np.full((len(u), 1), number, dtype=np.intp), np.ones((len(u), 1)))
        x, y, _ = tables.vndf.sample(u, v, at)
        wo = tables.outgoing(wi, x, y)
        above = (wi[:, 2] > _HORIZON) & (wo[:, 2] > _HORIZON)
        scale = tables.scale(x[above], y[above], wi[above]) / wo[above, 2]
        incident.append(wi[above])
        outgoing.append(wo[above])
        values.append(tables.values[number].reshape(-1, height * width).T[above] * scale[:, None])
    kept = sum(len(part) for part in incident)
    if kept == 0:
        raise FormatError("Expected the file to hold a node above the horizon, got none. The file is damaged.")
    below = len(tables.values) * len(u) - kept
    return Samples(
        np.concatenate(incident),
        np.concatenate(outgoing),
        np.concatenate(values),
        tables.channels,
        masked=[Masked(_BELOW, below)] if below else [],
        source=path.name,
        format="rgl",
        azimuth_observed=not tables.isotropic,
    )


def load(path: Path) -> Rgl:
    """The tables of a file; FormatError where one is missing, of a wrong shape, or not finite."""
    found = tensors(path.read_bytes())
    arrays: dict[str, Array] = {}
    spectral = "spectra" in found
    colour = {"spectra": 5, "wavelengths": 1} if spectral else {"rgb": 5}
    check_numbers(sum(found[name].size for name in _FIELDS | colour if name in found))
    for name, dimensions in (_FIELDS | colour).items():
        if name not in found:
            raise FormatError(f"Expected the .bsdf file to hold {name!r}, got none. It is no file of the RGL database.")
        if found[name].ndim != dimensions or 0 in found[name].shape:
            raise _misshapen(name, f"an array of {dimensions} dimensions", found[name].shape)
        with np.errstate(invalid="ignore"):  # a signalling NaN, which the next check names
            arrays[name] = found[name].astype(np.float64)
        if not np.isfinite(arrays[name]).all():
            raise FormatError(f"Expected {name} to be finite, got a value that is not. Fetch the file again.")
    values = arrays["spectra" if spectral else "rgb"]
    incidences = (len(arrays["phi_i"]), len(arrays["theta_i"]))
    count = len(arrays["wavelengths"]) if spectral else 3
    for name in ("vndf", "luminance", *colour):
        if name != "wavelengths" and (arrays[name].shape[:2] != incidences or min(arrays[name].shape[-2:]) < 2):
            raise _misshapen(name, f"of shape {incidences} and at least 2 x 2", arrays[name].shape)
    if values.shape[2] != count or values.shape[3:] != arrays["luminance"].shape[2:]:
        raise _misshapen("the values", f"{count} channels of luminance's shape", values.shape)
    for name in ("ndf", "sigma"):
        if min(arrays[name].shape) < 2:
            raise _misshapen(name, "at least 2 x 2", arrays[name].shape)
    for name in ("phi_i", "theta_i"):
        if (np.diff(arrays[name]) <= 0).any() or np.abs(arrays[name]).max() > 2 * math.pi:
            raise FormatError(f"Expected {name} to be increasing angles in radians, got others. Fetch the file again.")
    for name in ("vndf", "luminance", "sigma"):
        arrays[name] = np.maximum(arrays[name], 0)  # noise of 1e-10 below 0
        table = arrays[name].reshape(-1, *arrays[name].shape[-2:])
        if (table.max((1, 2)) <= 0).any() or (name == "sigma" and table.min() <= 0):
            raise FormatError(f"Expected {name} to be a density, got values that are none. Fetch the file again.")
    return _tables(arrays, values, spectral)


def _tables(arrays: dict[str, Array], values: Array, spectral: bool) -> Rgl:
    wavelengths = arrays.get("wavelengths", np.zeros(0))
    return Rgl(
        arrays["phi_i"],
        arrays["theta_i"],
        Table(arrays["ndf"][None]),
        Table(arrays["sigma"][None]),
        Warp(arrays["vndf"].reshape(-1, *arrays["vndf"].shape[2:])),
        Warp(arrays["luminance"].reshape(-1, *arrays["luminance"].shape[2:])),
        values.reshape(-1, *values.shape[2:]),
        tuple(f"{w:.9g}" for w in wavelengths) if spectral else ("r", "g", "b"),
        bool(arrays["jacobian"][0]),
    )


def _misshapen(name: str, rule: str, shape: tuple[Any, ...]) -> FormatError:
    return FormatError(f"Expected {name} to be {rule}, got shape {tuple(shape)}. Fetch the file again.", field=name)


def _azimuth(w: Array) -> Array:
    found: Array = np.arctan2(w[:, 1], w[:, 0])
    return found


def _elevation(w: Array) -> Array:
    """The polar angle [rad], exact near the normal too."""
    found: Array = np.arctan2(np.hypot(w[:, 0], w[:, 1]), w[:, 2])
    return found


FORMAT = Format(
    name="rgl",
    description="RGL .bsdf: a tensor file with vndf, sigma, luminance, and rgb or spectra",
    sniff=sniff,
    read=read,
)
