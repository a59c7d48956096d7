"""The parts of a scene as JSON-able data and back, each mistake one sentence with the place where it is."""

import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from torch import Tensor

from ..errors import BrdfError, InvalidValueError, unknown_name
from ..models.material import Material, material
from ..tabulated import Tabulated
from . import _checks

MEASURED = "measured"  # the key of a measured file


def fields(kind: type, data: object, where: str) -> dict[str, Any]:
    """The fields of a dataclass in JSON data, with unknown and missing ones told."""
    what = where or "the scene"
    if not isinstance(data, Mapping):
        raise InvalidValueError(
            f"Expected {what} to be an object, got {data!r}. Write {{...}}.", field=where or "scene"
        )
    declared = {field.name: field for field in dataclasses.fields(kind)}
    prefix = f"{where}." if where else ""
    for name in data:
        if name not in declared:
            raise unknown_name(f"a field of {what}", str(name), declared, field=f"{prefix}{name}")
    for name, field in declared.items():
        if field.default is dataclasses.MISSING and name not in data:
            raise InvalidValueError(
                f"Expected {prefix}{name} to be given, got nothing. Add it to {what}.", field=f"{prefix}{name}"
            )
    return dict(data)


def of_kind(
    entry: object,
    kinds: Mapping[str, type],
    where: str,
    materials: dict[str, Material | Tabulated],
    folder: Path | None,
) -> Any:
    """The shape or light of an entry; objects with the same material's data share one material."""
    if not isinstance(entry, Mapping) or not isinstance(entry.get("kind"), str):
        raise InvalidValueError(
            f"Expected {where}.kind to be one of {', '.join(kinds)}, got {entry!r}. Name the kind.",
            field=f"{where}.kind",
        )
    if entry["kind"] not in kinds:
        raise unknown_name(f"{where}.kind", entry["kind"], kinds, field=f"{where}.kind")
    kind = kinds[entry["kind"]]
    found = fields(kind, {name: value for name, value in entry.items() if name != "kind"}, where)
    if "material" in found:
        key = json.dumps(found["material"], sort_keys=True)
        if key not in materials:
            try:
                materials[key] = _material(found["material"], folder)
            except BrdfError as error:
                raise type(error)(f"{where}.material: {error.message}", field=f"{where}.material") from None
        found["material"] = materials[key]
    return made(kind, found, where)


def _material(given: Any, folder: Path | None) -> Material | Tabulated:
    """The material of a text, of a measured file beside the scene's, or of what Material.to_json returned."""
    if isinstance(given, str):
        return material(given)
    if not isinstance(given, Mapping) or MEASURED not in given:
        return Material.from_json(given)
    if list(given) != [MEASURED] or not isinstance(given[MEASURED], str):
        raise InvalidValueError(
            f"Expected a measured material to be a file's path and no more, got {dict(given)!r}. "
            f'Write {{"{MEASURED}": "FILE"}}.'
        )
    if folder is None:
        raise InvalidValueError(
            f"Expected no measured file in a scene that is no file itself, got {given[MEASURED]!r}. "
            "Load the scene from a file, or name the folder that the path is in."
        )
    return Tabulated.read(folder / given[MEASURED])


def made(kind: type, given: Mapping[str, Any], where: str) -> Any:
    """An instance, or its error with the place."""
    try:
        return kind(**given)
    except BrdfError as error:
        raise _checks.located(error, where) from None


def part(one: object, kinds: Mapping[str, type]) -> dict[str, Any]:
    """A shape or light as JSON-able data."""
    kind = next(name for name, made in kinds.items() if type(one) is made)
    return {"kind": kind, **{name: plain(value) for name, value in vars(one).items() if value not in (None, "")}}


def plain(value: object) -> Any:
    """A value of a part as JSON-able data; of a table, the path of its file."""
    if isinstance(value, Material):
        return value.to_json()
    if isinstance(value, Tabulated):
        if value.path is None:
            raise InvalidValueError(
                f"Expected a table that was read from a file, got {value}. Write it as one, and read that.",
                field="material",
            )
        return {MEASURED: str(value.path.absolute())}
    if isinstance(value, Tensor) or (isinstance(value, Sequence) and not isinstance(value, str)):
        return _checks.as_json(value)
    return value
