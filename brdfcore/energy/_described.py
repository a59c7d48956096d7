"""Directional albedos as the command line and the service read and write them, with angles in degrees."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from torch import Tensor

from ..errors import InvalidValueError
from ..models.material import Material
from .albedo import Albedo

_ANGLES = ("theta", "phi")


def described(material: Material, theta_deg: Sequence[float], phi_deg: float, found: Albedo) -> dict[str, Any]:
    """Albedos (N, C) as JSON-able data, angles in degrees; null where there is no finite number."""
    return {
        "material": str(material),
        "theta_deg": list(theta_deg),
        "phi_deg": phi_deg,
        "values": finite(found.values),
        "error": finite(found.error),
        "tolerance": found.tolerance,
        "met": found.met,
        "method": found.method,
        "evaluations": found.evaluations,
        "seconds": found.seconds,
    }


def finite(numbers: Tensor) -> Any:
    """The numbers as nested lists, None where one is not finite."""
    listed = numbers.tolist()
    if bool(numbers.isfinite().all()):
        return listed
    if numbers.ndim == 1:
        return [x if math.isfinite(x) else None for x in listed]
    return [finite(row) for row in numbers]


def axes_in_radians(asked: Mapping[str, Sequence[float] | None]) -> dict[str, tuple[float, float] | None]:
    """The axes of a table as `albedo_table` takes them, of axes whose angle is named theta_deg and is in degrees."""
    axes: dict[str, tuple[float, float] | None] = {}
    for name, ends in asked.items():
        if name in _ANGLES:
            raise InvalidValueError(
                f"Expected the axis {name} to be named {name}_deg, since its ends are in degrees here. Rename it.",
                field="axes",
            )
        pair = None if ends is None else (float(ends[0]), float(ends[1]))
        if name == "theta_deg" and pair is not None:
            if not 0 <= pair[0] < pair[1] <= 90:
                raise InvalidValueError(
                    f"Expected the axis theta_deg to be a range within [0, 90], got ({pair[0]:g}, {pair[1]:g}). "
                    "Give its lowest and its highest angle.",
                    field="axes",
                )
            pair = math.radians(pair[0]), math.radians(pair[1])
        axes[name.removesuffix("_deg") if name.removesuffix("_deg") in _ANGLES else name] = pair
    return axes
