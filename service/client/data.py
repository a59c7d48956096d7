"""What a client sends: measurements and materials of any kind, as the wire wants them."""

import io
import os
from collections.abc import Mapping
from typing import Any

from ..schemas import DatasetView
from .calls import Call, read
from .errors import ClientError

INLINE_ROWS = 10_000  # more samples than these travel as a file
_COLUMNS = ("wi", "wo", "values", "channels", "sigma", "weight", "cell", "azimuth_observed")


def placed(data: Any, declared: Mapping[str, Any]) -> Call[dict[str, Any]]:
    """The fields of a fit's body that say what its data are; a file, or what is as large as one, is uploaded first."""
    if isinstance(data, DatasetView):
        return {"dataset": data.id}
    if isinstance(data, str | os.PathLike):
        dataset = yield from uploaded(data, declared)
        return {"dataset": dataset.id}
    if declared.get("rgb"):
        raise ClientError("Expected rgb to go with a file, got samples. Pass what their to_rgb() returns, without rgb.")
    columns = _columns(data, declared.get("quantity"))
    if len(columns["values"]) <= INLINE_ROWS:
        return {"samples": columns}
    dataset = yield from _dataset(_npz(columns), {"angle_unit": "degrees"})
    return {"dataset": dataset.id}


def uploaded(path: str | os.PathLike[str], declared: Mapping[str, Any]) -> Call[DatasetView]:
    """The dataset made of a file, which is streamed from the disk."""
    with open(path, "rb") as file:
        return (yield from _dataset(file, declared))


def material_of(given: Any) -> Any:
    """A material as the wire wants it."""
    return given.to_json() if hasattr(given, "to_json") else plain(given)


def plain(value: Any) -> Any:
    """Lists and numbers for arrays, tensors and tuples."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, Mapping):
        return {name: plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value


def _dataset(file: Any, declared: Mapping[str, Any]) -> Call[DatasetView]:
    given = {name: value for name, value in declared.items() if value is not None}
    headers = {"content-type": "application/octet-stream"}
    return (yield from read(DatasetView, "POST", "/v1/datasets", content=file, params=given, headers=headers))


def _columns(data: Any, quantity: str | None) -> dict[str, Any]:
    """Inline samples as the wire wants them, of a mapping or of an object with the attributes of brdfcore.Samples."""
    if isinstance(data, Mapping):
        found = {name: plain(value) for name, value in data.items()}
        if quantity is not None:
            found["quantity"] = quantity
    else:
        found = {name: plain(getattr(data, name, None)) for name in _COLUMNS}
        found["quantity"] = "brdf"  # whatever was declared, Samples keeps the BRDF
    for name in ("values", "sigma"):
        rows = found.get(name)
        if rows and not isinstance(rows[0], list):
            found[name] = [[value] for value in rows]
    if "values" not in found:
        raise ClientError("Expected data to hold values, got none. Give values, quantity, and wi and wo or the angles.")
    return {name: value for name, value in found.items() if value is not None}


def _npz(columns: Mapping[str, Any]) -> bytes:
    """The columns as the bytes of a NumPy archive that brdfcore reads."""
    import numpy as np  # only who sends many samples needs it

    arrays = {name.removesuffix("_deg"): np.asarray(value) for name, value in columns.items()}
    if "azimuth_observed" in columns:
        arrays["azimuth_observed"] = np.asarray(str(columns["azimuth_observed"]).lower())
    out = io.BytesIO()
    np.savez(out, allow_pickle=False, **arrays)
    return out.getvalue()
