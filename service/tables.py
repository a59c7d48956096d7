"""Tables of albedos on disk, each named by the hash of what made it: tables/<hash>.npz."""

import json
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import brdfcore as bc
from brdfcore.energy._described import axes_in_radians
from brdfcore.energy.tables import Range, check

from .materials import material_of
from .schemas import AlbedoRequest

Kind = Literal["npz", "json"]
_TOLERANCE = 1e-4  # where a request states none
_ANGLES = ("theta", "phi")


def checked(asked: AlbedoRequest) -> dict[str, Any]:
    """What to show of a table's request; raises what can be told before the work."""
    material, axes, tolerance = _arguments(asked)
    check(material, axes, tolerance)
    return {"material": str(material), "axes": asked.axes, "tolerance": tolerance}


def made(asked: AlbedoRequest, data: Path, progress: Callable[[float], None]) -> dict[str, Any]:
    """Facts about the table that was asked for, which is on disk afterwards."""
    material, axes, tolerance = _arguments(asked)
    (data / "tables").mkdir(exist_ok=True)
    table = bc.albedo_table(material, axes, tolerance, cache=data / "tables", progress=progress)
    path = _path(data, table.hash)
    try:
        os.utime(path)  # one that is asked for again is new: what is old and no job's is removed
    except FileNotFoundError:  # it could not be kept: this raises why
        table.save(path)
    return {
        "hash": table.hash,
        "axes": [_axis(axis, count) for axis, count in zip(table.axes, table.values.shape, strict=False)],
        "channels": table.values.shape[-1],
        **{name: getattr(table, name) for name in ("tolerance", "error", "met", "evaluations", "seconds")},
    }


def content(data: Path, name: str, kind: Kind) -> bytes | None:
    """A kept table as the bytes of an npz or JSON file; None where there is none."""
    path = _path(data, name)
    try:
        if kind == "npz":
            return path.read_bytes()
        return json.dumps(bc.AlbedoTable.load(path).to_dict(), allow_nan=False).encode()
    except FileNotFoundError:
        return None


def remove(data: Path, name: str) -> None:
    """Remove a kept table."""
    _path(data, name).unlink(missing_ok=True)


def _path(data: Path, name: str) -> Path:
    return data / "tables" / f"{name}.npz"


def _arguments(asked: AlbedoRequest) -> tuple[bc.Material, dict[str, Range], float]:
    """The material, the axes in radians, and the tolerance."""
    tolerance = _TOLERANCE if asked.tolerance is None else asked.tolerance
    return material_of(asked.material), axes_in_radians(asked.axes or {}), tolerance


def _axis(axis: Any, count: int) -> dict[str, Any]:
    if axis.name in _ANGLES:
        low, high = math.degrees(axis.low), math.degrees(axis.high)
        return {"name": f"{axis.name}_deg", "low": low, "high": high, "nodes": count}
    return {"name": axis.name, "low": axis.low, "high": axis.high, "nodes": count}
