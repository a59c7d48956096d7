"""The checks that measured samples pass, each with a sentence that names the field and the first row at fault."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from ..errors import SamplesError

Numbers: TypeAlias = Tensor | npt.ArrayLike
Where: TypeAlias = Callable[[int], str]  # what an error calls a row: "line 17", "row 3"

UNIT_TOLERANCE = 1e-4  # directions that a file prints with five digits are still unit
ROUNDING = 1e-15  # a few float64 ulp: directions this close to unit are kept bit for bit


def default_where(row: int) -> str:
    """A row of an array, as an error calls it."""
    return f"row {row} (counted from 0)"


def as_numbers(field: str, given: Numbers) -> Tensor:
    """A float64 copy on the CPU of an array of real numbers."""
    if isinstance(given, Tensor):
        if given.dtype == torch.bool or given.is_complex():
            raise _not_numbers(field, str(given.dtype))
        return given.detach().to("cpu", torch.float64, copy=True).contiguous()
    try:
        array = np.asarray(given)
    except (TypeError, ValueError, RuntimeError, OverflowError) as error:
        raise _not_numbers(field, f"{type(given).__name__} ({error})") from error
    if array.dtype.kind not in "iuf":
        raise _not_numbers(field, f"an array of {array.dtype}")
    with np.errstate(over="ignore"):  # a long double beyond float64 becomes infinite, which the next check names
        return torch.from_numpy(np.array(array, dtype=np.float64, order="C"))


def _not_numbers(field: str, got: str) -> SamplesError:
    return SamplesError(
        f"Expected {field} to be an array of real numbers, got {got}. Pass a tensor, a NumPy array or nested lists.",
        field=field,
    )


def require(
    field: str, good: Tensor, shown: Tensor, rule: str, advice: str, where: Where, channels: tuple[str, ...] = ()
) -> None:
    """None where every entry of `good`, (N,) or (N, C), is true; else SamplesError names the first that is not."""
    if bool(good.all()):
        return
    first = tuple((~good).nonzero()[0].tolist())
    got = shown[first]
    text = f"{got.item():.9g}" if got.ndim == 0 else "(" + ", ".join(f"{x:.9g}" for x in got.tolist()) + ")"
    channel = f", channel {channels[first[1]]!r}" if len(channels) > 1 and len(first) > 1 else ""
    raise SamplesError(
        f"Expected {field} to be {rule}, got {text} at {where(first[0])}{channel}. {advice}", field=field
    )


def unit_directions(field: str, given: Numbers, where: Where) -> Tensor:
    """Unit vectors above the horizon, (N, 3), from nearly unit ones."""
    directions = as_numbers(field, given)
    if directions.ndim != 2 or directions.shape[1] != 3:
        raise SamplesError(
            f"Expected {field} to be of shape (N, 3), got {tuple(directions.shape)}. "
            "Pass one unit vector a sample, or use Samples.from_angles.",
            field=field,
        )
    if len(directions) == 0:
        raise SamplesError(
            f"Expected {field} to hold at least one sample, got none. Pass measured directions and values.",
            field=field,
        )
    finite = directions.isfinite().all(-1)
    require(field, finite, directions, "finite", "Remove the sample or correct its direction.", where)
    # scaled by the largest component, so that a huge one is reported with its length instead of overflowing
    largest = directions.abs().amax(-1, keepdim=True).clamp_min(torch.finfo(torch.float64).tiny)
    norm = largest * (directions / largest).norm(dim=-1, keepdim=True)
    require(
        field,
        ((norm - 1).abs() <= UNIT_TOLERANCE)[:, 0],
        directions,
        f"unit vectors (length 1 within {UNIT_TOLERANCE:g})",
        "Divide each direction by its length, or use Samples.from_angles.",
        where,
    )
    require(
        field,
        directions[:, 2] > 0,
        directions,
        "above the horizon (z > 0)",
        "Both directions leave the surface and z is its normal: turn the vector round or remove the sample.",
        where,
    )
    return torch.where((norm - 1).abs() <= ROUNDING, directions, directions / norm)


def per_channel(field: str, given: Numbers, count: int) -> Tensor:
    """Numbers a sample and channel, (N, C), from (N, C) or (N,)."""
    numbers = as_numbers(field, given)
    if numbers.ndim == 1:
        numbers = numbers[:, None]
    if numbers.ndim != 2 or len(numbers) != count or numbers.shape[1] == 0:
        raise SamplesError(
            f"Expected {field} to be of shape ({count}, C) or ({count},) as there are {count} directions wi, "
            f"got {tuple(numbers.shape)}. Pass one row a sample.",
            field=field,
        )
    return numbers


def per_sample(field: str, given: Numbers | None, count: int, where: Where) -> Tensor | None:
    """Non-negative finite numbers, one a sample, (N,), not all zero; None for None."""
    if given is None:
        return None
    numbers = as_numbers(field, given)
    if numbers.shape != (count,):
        raise SamplesError(
            f"Expected {field} to be of shape ({count},), got {tuple(numbers.shape)}. Pass one number a sample.",
            field=field,
        )
    good = numbers.isfinite() & (numbers >= 0)
    require(field, good, numbers, "finite and not negative", "Use 0 to leave a sample out.", where)
    if not bool((numbers > 0).any()):
        raise SamplesError(
            f"Expected {field} to be positive for at least one sample, got only zeros. Leave {field} out to use 1.",
            field=field,
        )
    return numbers
