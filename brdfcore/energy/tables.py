"""Tables of directional albedos over angles and parameters, interpolated to a stated accuracy.

    a(theta, phi, p, q, ...) = sum over j, k, l, ... of c_jk.. T_j(x_theta) T_k(x_phi) T_l(x_p) ...                [1]

The table holds the albedo at the Chebyshev nodes of every axis, in a coordinate in which it is smooth (_axes.py), so a
table of 30 x 20 numbers serves 1e-4 for a lobe of any width. The number of nodes of each axis is read off the decay of
the coefficients along lines through the box, and the result is checked at random points between the nodes; what is
claimed is twice the largest difference found there, and the error that the quadrature claims besides
(tests/energy/test_tables.py holds it against other points).

A table is kept under the hash of what made it: brdfcore's version, the material without the values that are axes, the
axes and the tolerance.
"""

import functools
import hashlib
import json
import os
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from .. import __version__
from ..errors import BrdfError, InvalidValueError, unknown_name
from ..models.material import Material, material
from . import _axes, _chebyshev, _table_files
from ._axes import Axis
from ._tabulate import require_end, tabulate

Range = tuple[float, float] | None


@dataclass(frozen=True, eq=False)
class AlbedoTable:
    """Albedos at the nodes of the axes, and what they cost; call it, or `evaluate`, for those between.

    material    what the table is of; the values of its axes mean nothing here
    axes        theta, phi where the material is anisotropic, and the parameters, in the order of the values' axes
    values      (n_1, ..., n_d, C) [1], float64
    error       largest error claimed for an interpolated albedo a, as a share of max(1, a)
    """

    material: Material
    axes: tuple[Axis, ...]
    values: Tensor
    tolerance: float
    error: float
    met: bool  # error <= tolerance
    evaluations: int  # directions at which lobes were evaluated, checks included
    seconds: float  # that making it took, once
    hash: str

    def __repr__(self) -> str:
        size = " x ".join(f"{axis.name} {n}" for axis, n in zip(self.axes, self.values.shape, strict=False))
        return f"AlbedoTable({self.material.form.text()}: {size}; error {self.error:.1e})"

    def nodes(self) -> dict[str, Tensor]:
        """The values of each axis at its nodes, (n,), ascending [rad, or the parameter's unit]."""
        return {axis.name: axis.nodes(n) for axis, n in zip(self.axes, self.values.shape, strict=False)}

    def __call__(self, theta: float | Tensor, phi: float | Tensor = 0.0, **values: float | Tensor) -> Tensor:
        """The same as `evaluate`."""
        return self.evaluate(theta, phi, **values)

    def evaluate(self, theta: float | Tensor, phi: float | Tensor = 0.0, **values: float | Tensor) -> Tensor:
        """The directional albedo [1], (..., C), for angles [rad] and a value for each parameter that is an axis.

        All broadcast; a tensor's dtype and device are kept, numbers give float64. Differentiable in all of them. Where
        the material is isotropic, phi has no effect. Raises InvalidValueError outside the table, and for a parameter
        that is missing; UnknownNameError for one that is no axis. A parameter's key has a dot in it:
        table(theta, **{"ward_bounded.a": 0.1}).
        """
        given: dict[str, float | Tensor] = {"theta": theta, **values}
        names = [axis.name for axis in self.axes if axis.name != "phi"]
        for name in given:
            if name not in names:
                raise unknown_name("a parameter of the table", name, names, field=name)
        for axis in self.axes:
            if axis.name == "phi":
                continue
            if axis.name not in given:
                raise InvalidValueError(
                    f"Expected {axis.name} to be given, since it is an axis of the table, got nothing. "
                    f"Pass **{{{axis.name!r}: ...}}.",
                    field=axis.name,
                )
            value = torch.as_tensor(given[axis.name], dtype=_dtype(given[axis.name])).detach()
            slack = 4 * torch.finfo(value.dtype).eps
            outside = ~((value >= axis.low * (1 - slack)) & (value <= axis.high * (1 + slack)))
            if bool(outside.any()):
                raise InvalidValueError(
                    f"Expected {axis.name} to be within the table, [{axis.low:.6g}, {axis.high:.6g}], "
                    f"got {float(value[outside].reshape(-1)[0]):.12g}. Make a table over a wider range.",
                    field=axis.name,
                )
        return self.interpolate(given | {"phi": phi})

    def interpolate(self, given: Mapping[str, float | Tensor]) -> Tensor:
        """What `evaluate` returns, without its checks: a value outside the table counts as the end of its axis.

        No value decides a branch here, so it can be batched by vmap and compiled.
        """
        tensors = [value for value in given.values() if isinstance(value, Tensor)]
        device = tensors[0].device if tensors else None
        dtype = functools.reduce(torch.promote_types, map(_dtype, tensors or given.values()))
        inner = {name: torch.as_tensor(value, dtype=torch.float64, device=device) for name, value in given.items()}
        x = {axis.name: axis.x(inner[axis.name]) for axis in self.axes if axis.name != "phi"}
        if len(x) < len(self.axes):
            factor = _axes.stretch(self._ratios, self.material.form, self._fixed | inner)
            x["phi"] = _axes.PHI.x(_axes.turned(inner["phi"], factor))
        return _chebyshev.contract(self._coefficients.to(device), [x[axis.name] for axis in self.axes]).to(dtype)

    @cached_property
    def _coefficients(self) -> Tensor:
        return _chebyshev.coefficients(self.values, len(self.axes))

    @cached_property
    def _ratios(self) -> tuple[_axes.Ratio, ...]:
        return _axes.ratios(self.material.form)

    @cached_property
    def _fixed(self) -> dict[str, Tensor]:
        return {key: value.detach() for key, value in self.material.values().items()}

    def save(self, path: str | Path) -> Path:
        """The path of the file that the table was written to, .npz or .json by its suffix."""
        return _table_files.save(self.to_dict(), Path(path))

    @classmethod
    def load(cls, path: str | Path) -> "AlbedoTable":
        """The table of a file that `save` wrote; FormatError where it is none."""
        return cls.from_dict(_table_files.load(Path(path)))

    def to_dict(self) -> dict[str, Any]:
        """The table as JSON-able data, which say how to read them."""
        return _table_files.described(self)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> "AlbedoTable":
        """The table that `to_dict` described; FormatError where it is none."""
        return cls(**_table_files.fields(data))


def _dtype(value: float | Tensor) -> torch.dtype:
    """The floating dtype of a tensor; float64 for what has none."""
    return value.dtype if isinstance(value, Tensor) and value.is_floating_point() else torch.float64


def albedo_table(
    model: Material | str,
    axes: Mapping[str, Range] | None = None,
    tolerance: float = 1e-4,
    *,
    cache: str | Path | bool | None = True,
    progress: Callable[[float], None] | None = None,
) -> AlbedoTable:
    """A table of directional albedos [1] whose interpolation is within the tolerance times max(1, albedo).

    model       a material or its text, whose values hold for all that is no axis
    axes        name -> (lowest, highest), or None for the usual range: "theta" [rad], by default to the horizon, and
                any parameters, by default over the range that fits search. theta is always an axis; so is phi where
                the material is anisotropic, and it needs no range.
    cache       where tables are kept: True is brdfcore/albedo in the user's cache folder ($XDG_CACHE_HOME, else
                ~/.cache; ~/Library/Caches on macOS, %LOCALAPPDATA% on Windows), a path is another folder, None or
                False nowhere
    progress    is called with the share that is done, from 0 to 1

    Raises InvalidValueError or UnknownNameError for axes that the material has not; for a theta without an end where
    the albedo grows beyond all bounds towards grazing (`kurt` with alpha > 0, `ward`), which needs one, as in
    {"theta": (0, 1.5)}; and for a table that would take more than 2^20 numbers. Where the tolerance is not met within
    that, or the quadrature cannot, `met` is False and `error` says what was reached.
    """
    made = material(model) if isinstance(model, str) else model
    chosen = check(made, axes, tolerance)
    name = _hash(made, chosen, tolerance)
    folder = cache_folder() if cache is True else Path(cache) if cache else None
    kept = _table_files.kept(folder, name) if folder else None
    if kept is not None:
        with suppress(BrdfError):  # another program's file under this name
            return AlbedoTable.from_dict(kept)
    table = AlbedoTable(made, hash=name, tolerance=tolerance, **tabulate(made, chosen, tolerance, progress))
    if folder is not None:
        _table_files.keep(table.to_dict(), folder, name)
    return table


def check(made: Material, axes: Mapping[str, Range] | None, tolerance: float) -> tuple[Axis, ...]:
    """The axes that were asked for, theta first; raises what `albedo_table` would raise before it makes the table."""
    if not 1e-12 <= tolerance <= 0.1:
        raise InvalidValueError(
            f"Expected tolerance to be within [1e-12, 0.1], got {tolerance:g}. It is the largest error of an albedo.",
            field="tolerance",
        )
    asked = axes or {}
    if asked.get("phi") is not None:
        raise InvalidValueError(
            f"Expected the axis phi to have no range, since a table holds every azimuth, got {asked['phi']!r}. "
            "Leave it out.",
            field="axes",
        )
    keys = [key for key in asked if key not in ("theta", "phi")]
    chosen = (_axes.of_theta(asked.get("theta")), *(_axes.of_parameter(made.form, key, asked[key]) for key in keys))
    require_end(made, chosen, tolerance)
    return chosen


def _hash(made: Material, axes: tuple[Axis, ...], tolerance: float) -> str:
    """The sha256 of what makes a table."""
    described = made.to_json()
    for axis in axes:
        described["values"].pop(axis.name, None)
    what = [__version__, described, [vars(axis) for axis in axes], tolerance]
    return hashlib.sha256(json.dumps(what, sort_keys=True).encode()).hexdigest()


def cache_folder() -> Path:
    """The folder in which tables are kept unless another is named."""
    if sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    elif sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "brdfcore" / "albedo"
