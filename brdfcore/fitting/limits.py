"""What the user narrows: the boxes of values, the angles of samples, and how much a large residual counts."""

import math
from collections.abc import Iterable, Mapping
from typing import Any

import torch
from torch import Tensor

from ..errors import ParameterError, unknown_name
from ..models.form import Form
from .given import check_known
from .robust import ROBUST


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def checked_bounds(
    form: Form, bounds: Mapping[str, object] | None, start: Mapping[str, Tensor], given: Iterable[str]
) -> dict[str, Any]:
    """The bounds as pairs of floats; raises for one that is none, leaves its box, or excludes a given value."""
    found = {}
    for key, pair in (bounds or {}).items():
        if key not in form.parameters:
            raise unknown_name("a key of bounds", key, form.parameters, field="bounds")
        if not isinstance(pair, list | tuple) or len(pair) != 2 or not all(map(_is_number, pair)) or pair[0] >= pair[1]:
            raise ParameterError(
                f"Expected the bounds of {key} to be two numbers, the lower one first, got {pair!r}. "
                "Use fixed for one value.",
                field="bounds",
            )
        low, high = float(pair[0]), float(pair[1])
        parameter = form.parameters[key]
        if not bool(parameter.contains(torch.tensor([low, high], dtype=torch.float64)).all()):
            raise ParameterError(
                f"Expected the bounds of {key} to lie in {parameter.box}, got ({low:g}, {high:g}). "
                f"It is the {parameter.description}; narrow them.",
                field="bounds",
            )
        least, most = form.bounds(key, start[key])
        if bool((least.clamp(min=low) > most.clamp(max=high)).any()):
            raise ParameterError(
                f"Expected the bounds of {key} to leave a value that its ties allow, got ({low:g}, {high:g}) where "
                f"those leave [{float(least.max()):g}, {float(most.min()):g}]. Change one of them.",
                field="bounds",
            )
        if key in given and bool(((start[key] < low) | (start[key] > high)).any()):
            raise ParameterError(
                f"Expected the value of {key} to be within its bounds ({low:g}, {high:g}), got "
                f"{start[key].tolist()}. Change one of them.",
                field=key,
            )
        found[key] = (low, high)
    return found


def check_robust(robust: object, scale: object) -> None:
    """Raise where these are no robust form and no scale of one."""
    if robust is not None:
        check_known("a robust form", robust, ROBUST, "robust")
    if scale is None:
        return
    if robust is None:
        raise ParameterError(
            f"Expected robust_scale to come with a robust form, got {scale!r} alone. Name one of {', '.join(ROBUST)}.",
            field="robust_scale",
        )
    if not isinstance(scale, int | float) or not _is_number(scale) or scale <= 0:
        raise ParameterError(
            f"Expected robust_scale to be a positive number, got {scale!r}. Give it in the residual's unit, or leave "
            "it to the data.",
            field="robust_scale",
        )


def check_max_theta(angle: object) -> None:
    """Raise where this is neither None nor a polar angle in radians."""
    if angle is not None:
        check_angle(angle)


def check_angle(angle: object) -> None:
    """Raise where this is no polar angle in radians."""
    if isinstance(angle, int | float) and _is_number(angle) and 0 < angle <= math.pi / 2:
        return
    raise ParameterError(
        f"Expected max_theta to be an angle in (0, pi/2] radians, got {angle!r}. For 80 degrees pass math.radians(80).",
        field="max_theta",
    )
