"""Materials as files that other programs read: one file a form, each with its difference from the material stated.

A form's file holds one `Exporter`; listing it in EXPORTS is all that library, command line and service need.
"""

import math
import re
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Final

from ..errors import InvalidValueError, unknown_name
from ..models.material import Material, check_material
from . import brdf_explorer, material_json, merl, mitsuba, radiance
from ._export import Export, Exporter, Orientation

__all__ = ["EXPORTS", "Export", "Exporter", "export"]

EXPORTS: Final[dict[str, Exporter]] = {
    module.EXPORT.name: module.EXPORT for module in (radiance, mitsuba, brdf_explorer, merl, material_json)
}


def export(
    material: Material,
    format: str,  # noqa: A002 - the fixed public name
    path: str | PathLike[str] | None = None,
    *,
    orientation: Orientation | None = None,
) -> Export:
    """The material as another program's file, and the difference [1] from it; written to `path` where one is given.

    `format` is a name from EXPORTS. Where a form cannot hold the material, its nearest member is found and the
    difference says how near; where there is none to be found, InvalidValueError says why. `orientation` is where the
    material's x axis points in the scene, for a form that states it (radiance). The name that some forms give the
    material is the path's stem, or "brdf".
    """
    check_material(material)
    if format not in EXPORTS:
        raise unknown_name("format", str(format), EXPORTS, field="format")
    exporter = EXPORTS[format]
    if orientation is not None and not exporter.oriented:
        raise InvalidValueError(
            f"Expected orientation to be left out for {format}, whose files do not state it, got {orientation}. "
            "Turn the mesh's tangents instead.",
            field="orientation",
        )
    axis = None if orientation is None else _axis(orientation)
    stem = re.sub(r"\W+", "_", Path(path).stem, flags=re.ASCII) if path is not None else "brdf"
    name = stem if re.match(r"[A-Za-z]", stem) else f"brdf_{stem}"
    made = exporter.write(material, name, axis)
    if path is None:
        return made
    Path(path).write_bytes(made.to_bytes())
    return replace(made, path=Path(path))


def _axis(given: Orientation) -> Orientation:
    """The direction as three floats; InvalidValueError where it is none."""
    try:
        x, y, z = (float(component) for component in given)
    except (TypeError, ValueError):
        x = y = z = math.nan
    if not 0 < x * x + y * y + z * z < math.inf:
        raise InvalidValueError(
            f"Expected orientation to be a direction of three numbers, got {given}. Write (1.0, 0.0, 0.0).",
            field="orientation",
        )
    return x, y, z
