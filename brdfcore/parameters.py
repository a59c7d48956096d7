"""A model's parameter: name, meaning, physical box, where starts are searched, and how it is stored for optimisers."""

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import torch
from torch import Tensor

from .errors import ParameterError

Values = Mapping[str, Tensor]  # name -> () or (C,)


@dataclass(frozen=True)
class Parameter:
    """A parameter as a model declares it.

    `low` and `high` bound the physical set, closed unless `open_low` or `open_high`; `search` is the finite range
    from which fits draw starts. Optimisers see the raw value: log x where scale is "log", x itself where it is
    "linear" (an optimum on the end of a box stays reachable, and values round-trip). `per_channel`: "yes" for a
    reflectance, "no" for a shape, "optional" where one value is the rule and one a channel is possible.
    """

    name: str
    default: float
    low: float
    high: float
    description: str
    search: tuple[float, float] | None = None
    scale: Literal["linear", "log"] = "linear"
    per_channel: Literal["yes", "no", "optional"] = "no"
    open_low: bool = False
    open_high: bool = False

    @property
    def search_range(self) -> tuple[float, float]:
        """The range from which starts are drawn [the parameter's unit]."""
        return self.search or (self.low, self.high)

    @property
    def box(self) -> str:
        """The physical set in interval notation."""
        return f"{'(' if self.open_low else '['}{self.low:g}, {self.high:g}{')' if self.open_high else ']'}"

    def contains(self, value: Tensor) -> Tensor:
        """Where a value lies in the box (a NaN never does)."""
        above = value > self.low if self.open_low else value >= self.low
        below = value < self.high if self.open_high else value <= self.high
        return above & below

    def check_shape(self, key: str, value: Tensor) -> None:
        """Raise where a value has a shape that this parameter cannot have."""
        if value.ndim > 1 or (value.ndim == 1 and (self.per_channel == "no" or not value.numel())):
            shape = "one number" if self.per_channel == "no" else "one number or one a channel"
            raise ParameterError(
                f"Expected {key} to be {shape}, got {value.tolist()}. Give {self.name} as such.", field=key
            )

    def check(self, key: str, value: Tensor) -> None:
        """Raise where a value is outside the box, or has a shape that this parameter cannot have."""
        self.check_shape(key, value)
        inside = self.contains(value)
        if not bool(inside.all()):
            bad = value if value.ndim == 0 else value[~inside][0]
            raise ParameterError(
                f"Expected {key} to be in {self.box}, got {float(bad):.12g}. "
                f"It is the {self.description}; choose a value in that range.",
                field=key,
            )

    def to_raw(self, value: Tensor) -> Tensor:
        """The stored form of a value, on the raw ends where the value lies on an end of the box."""
        raw = torch.log(value) if self.scale == "log" else value
        return raw.clamp(*self.raw_ends(raw.dtype))

    def from_raw(self, raw: Tensor) -> Tensor:
        """The value of a stored form, clamped to the box; on an end of it the gradient still passes."""
        raw = raw.clamp(*self.raw_ends(raw.dtype))
        return torch.exp(raw) if self.scale == "log" else raw

    def ends(self, dtype: torch.dtype) -> tuple[float, float]:
        """The smallest and the largest value in the box that `from_raw` returns in this dtype."""
        low, high = (self.from_raw(torch.tensor(end, dtype=dtype)) for end in self.raw_ends(dtype))
        return float(low), float(high)

    def raw_ends(self, dtype: torch.dtype) -> tuple[float, float]:
        """The outermost raw values whose natural values, rounded, still lie in the box."""
        return _raw_ends(self, dtype)


@functools.cache
def _raw_ends(parameter: Parameter, dtype: torch.dtype) -> tuple[float, float]:
    def innermost(end: float, inwards: float) -> float:
        raw = torch.tensor(end, dtype=dtype)
        raw = torch.log(raw) if parameter.scale == "log" else raw
        towards = torch.tensor(inwards, dtype=dtype)
        # in double precision: the end itself, rounded, may lie outside
        while not bool(parameter.contains((torch.exp(raw) if parameter.scale == "log" else raw).double())):
            raw = torch.nextafter(raw, towards)
        return float(raw)

    return innermost(parameter.low, math.inf), innermost(parameter.high, -math.inf)
