"""What every part of a scene checks: numbers, vectors and colours, each with one sentence that names the field."""

import math
from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor

from ..errors import BrdfError, InvalidValueError

Vector = tuple[float, float, float]
LARGEST = 1e30  # of a number, so that no product of several overflows
Colour = float | Sequence[float] | Tensor  # one number, or red, green and blue


def vector(name: str, value: object) -> Vector:
    """Three finite numbers, or an error."""
    if isinstance(value, list | tuple) and len(value) == 3 and all(map(finite, value)):
        return (float(value[0]), float(value[1]), float(value[2]))
    raise InvalidValueError(
        f"Expected {name} to be three finite numbers, none beyond 1e30, got {value!r}. Write it as [x, y, z].",
        field=name,
    )


def direction(name: str, value: object) -> Vector:
    """The unit vector along three numbers, or an error where they are all 0."""
    x, y, z = vector(name, value)
    length = math.hypot(x, y, z)
    if length == 0:
        raise InvalidValueError(
            f"Expected {name} to be a direction, got a vector of length 0. Give it another.", field=name
        )
    return (x / length, y / length, z / length)


def positive(name: str, value: object) -> float:
    """A finite number above 0, or an error."""
    if finite(value) and value > 0:  # type: ignore[operator]
        return float(value)  # type: ignore[arg-type]
    raise InvalidValueError(
        f"Expected {name} to be a finite number above 0 and up to 1e30, got {value!r}. Give it a size.", field=name
    )


def whole(name: str, value: object, lowest: int, highest: int) -> int:
    """A whole number of a range, or an error."""
    if isinstance(value, int) and not isinstance(value, bool) and lowest <= value <= highest:
        return value
    raise InvalidValueError(
        f"Expected {name} to be a whole number from {lowest} to {highest}, got {value!r}. Choose another.", field=name
    )


def device(value: torch.device | str) -> torch.device:
    """The processor or a graphics card that is there, or an error."""
    try:
        found = torch.device(value)
    except RuntimeError:
        found = None
    cards = torch.cuda.device_count() if found is not None and found.type == "cuda" else 0
    if found is None or not (found.type == "cpu" or (found.index or 0) < cards):
        raise InvalidValueError(
            f"Expected device to be cpu, or cuda where torch finds such a card, got {str(value)!r}. Choose another.",
            field="device",
        )
    return found


def colour(name: str, value: object) -> Colour:
    """A number that is not negative, or three, or a tensor of either, which may be differentiated."""
    if isinstance(value, Tensor):
        numbers = value.detach().reshape(-1).tolist() if value.shape in ((), (1,), (3,)) else []
    else:
        numbers = list(value) if isinstance(value, list | tuple) else [value]
    if len(numbers) in (1, 3) and all(finite(x) and x >= 0 for x in numbers):
        return value  # type: ignore[return-value]
    raise InvalidValueError(
        f"Expected {name} to be one number or three, finite, not negative and up to 1e30, got {value!r}. "
        "Give red, green and blue, or one number.",
        field=name,
    )


def as_tensor(value: Colour, like: Tensor) -> Tensor:
    """The colour as (1,) or (3,), in the precision and on the device of another tensor."""
    return torch.as_tensor(value, dtype=like.dtype, device=like.device).reshape(-1)


def as_json(value: Colour) -> Any:
    """The colour as JSON-able data."""
    if isinstance(value, Tensor):
        return value.detach().tolist()
    return float(value) if isinstance(value, int | float) else [float(x) for x in value]


def located(error: BrdfError, where: str) -> BrdfError:
    """The same error with the place in the scene where it is."""
    field = f"{where}.{error.field}" if error.field else where
    message = error.message
    if error.field and message.startswith(f"Expected {error.field} "):
        message = message.replace(f"Expected {error.field}", f"Expected {field}", 1)
    else:
        message = f"{where}: {message}"
    return type(error)(message, field=field)


def finite(x: object) -> bool:
    """Whether it is a number, and none that is too large."""
    return isinstance(x, int | float) and not isinstance(x, bool) and abs(x) <= LARGEST
