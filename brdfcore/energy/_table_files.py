"""Tables of albedos as files: JSON and npz of the same content, and the folder that keeps them by their hash."""

import json
import os
import tempfile
import zipfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from .. import __version__
from ..errors import BrdfError, FormatError, InvalidValueError
from ..models.material import Material
from . import _axes
from ._axes import Axis

if TYPE_CHECKING:
    from .tables import AlbedoTable

KIND = "brdfcore albedo table"
HOW = (
    "values[i1][i2]...[c] is the directional albedo of channel c at node i1 of the first axis, i2 of the second, and "
    "so on. Between the nodes it is the Chebyshev interpolant in x = 2 (t - t_high) / (t_low - t_high) - 1, where t is "
    "the axis's coordinate: theta: t = max(1 - 2 theta / pi, 6.4e-13)^(1/3); phi: t = cos(2 phi'); log: t = ln(value); "
    "linear: t = value. tan(phi') = |tan(phi)| / s, s = the product of (above / below)^power over `stretch`. "
    "Of n nodes, node i lies at x = cos(pi i / (n - 1)). Angles are in radians."
)
_NUMBERS = ("tolerance", "error", "met", "evaluations", "seconds", "hash")


def described(table: "AlbedoTable") -> dict[str, Any]:
    """The table as JSON-able data."""
    nodes = table.nodes()
    values = {key: v.tolist() for key, v in table.material.values().items() if key not in nodes}
    return {
        "kind": KIND,
        "how": HOW,
        "version": __version__,
        "model": table.material.form.text(values),
        "material": table.material.to_json(),
        "stretch": [vars(ratio) for ratio in _axes.ratios(table.material.form)] if "phi" in nodes else [],
        **{name: getattr(table, name) for name in _NUMBERS},
        "axes": [{**vars(axis), "nodes": nodes[axis.name].tolist()} for axis in table.axes],
        "values": table.values.tolist(),
    }


def fields(data: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of the table that was described."""
    try:
        if data["kind"] != KIND:
            raise _no_table(f"the kind {data['kind']!r}")
        axes = tuple(Axis(*(given[name] for name in ("name", "low", "high", "coordinate"))) for given in data["axes"])
        values = torch.as_tensor(np.asarray(data["values"], dtype=np.float64))
        counts = [len(given["nodes"]) for given in data["axes"]]
        material = Material.from_json(data["material"])
        found = {"material": material, "axes": axes, "values": values} | {name: data[name] for name in _NUMBERS}
    except (KeyError, TypeError, ValueError) as error:
        if isinstance(error, BrdfError):
            raise
        raise _no_table(f"{type(error).__name__}: {error}") from error
    if list(values.shape[:-1]) != counts or not bool(values.isfinite().all()):
        raise _no_table(f"values of shape {tuple(values.shape)} for axes of {counts} nodes")
    return found


def save(data: Mapping[str, Any], path: Path) -> Path:
    """The path that the description was written to."""
    kind = require_suffix(path)
    if kind == ".json":
        path.write_text(json.dumps(data, allow_nan=False), encoding="utf-8")
        return path
    about = {name: value for name, value in data.items() if name != "values"}
    nodes = {axis["name"]: np.asarray(axis["nodes"]) for axis in data["axes"]}
    values = np.asarray(data["values"])
    with path.open("wb") as file:
        np.savez(file, allow_pickle=False, values=values, about=np.asarray(json.dumps(about)), **nodes)
    return path


def load(path: Path) -> dict[str, Any]:
    """The description in a file that `save` wrote."""
    kind = require_suffix(path)
    try:
        if kind == ".json":
            return dict(json.loads(path.read_text(encoding="utf-8")))
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            return {**json.loads(str(archive["about"])), "values": archive["values"]}
    except (ValueError, TypeError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise _no_table(f"{path.name}, {type(error).__name__}") from error


def kept(folder: Path, name: str) -> dict[str, Any] | None:
    """The description that is kept under that hash; None where there is none that can be read."""
    try:
        return load(folder / f"{name}.npz")
    except (OSError, BrdfError):  # none yet, or not a whole one
        return None


def keep(data: Mapping[str, Any], folder: Path, name: str) -> None:
    """Keep the description under its hash, whole or not at all; a folder that cannot be written to keeps nothing."""
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        handle, draft = tempfile.mkstemp(dir=folder, suffix=".npz")
        os.close(handle)
        try:
            save(data, Path(draft))
            Path(draft).replace(folder / f"{name}.npz")
        finally:
            Path(draft).unlink(missing_ok=True)


def require_suffix(path: Path) -> str:
    """The suffix of the path, .npz or .json; InvalidValueError for another, or for a folder that is missing."""
    suffix = path.suffix.lower()
    if suffix not in (".npz", ".json"):
        raise InvalidValueError(
            f"Expected the table's file to end in .npz or .json, got {path.suffix or 'no suffix'!r}. Rename it.",
            field="path",
        )
    if not path.parent.is_dir():
        raise InvalidValueError(
            f"Expected the table's folder to exist, got {str(path.parent)!r}. Make it first.", field="path"
        )
    return suffix


def _no_table(got: str) -> FormatError:
    return FormatError(
        f"Expected a table of albedos, got {got}. Pass what AlbedoTable.save or to_dict wrote.", field="table"
    )
