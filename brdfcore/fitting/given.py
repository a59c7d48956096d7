"""The keywords of `fit` made plain: lists read once, numbers of whatever type as Python's, and nothing of a wrong kind.

A generator is used up by whoever reads it first, so everything that fits several times makes its keywords plain before
anything else. What the values must be, and which keys there are, a plan checks (plan.py).
"""

import math
import operator
import sys
from collections.abc import Collection, Iterable, Mapping
from numbers import Real
from typing import Any

import numpy as np
from torch import Tensor

from ..errors import ParameterError, unknown_name

_KEYS = ("gray", "per_channel")
_MOST = int(sys.float_info.max)  # what a double holds
_NUMBERS = ("robust_scale", "max_theta")


def plainly(keywords: Mapping[str, Any]) -> dict[str, Any]:
    """The keywords of `fit`, each of those that are there plain; raises ParameterError for one of a wrong kind."""
    found = dict(keywords)
    for name in _KEYS:
        if name in found:
            found[name] = _keys(name, found[name])
    for name in ("fixed", "bounds"):
        if name in found:
            found[name] = _values(name, found[name])
    if "starts" in found:
        found["starts"] = _starts(found["starts"])
    for name in _NUMBERS:
        if name in found:
            found[name] = plain(found[name])
    if "seed" in found and (seed := whole(found["seed"])) is not None:
        found["seed"] = seed
    return found


def plain(value: object) -> Any:
    """A number, or a list of them, as Python has them, where it is one of numpy's or torch's; else as it is."""
    if isinstance(value, Tensor):
        return value.detach().tolist()
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        each = map(plain, value)
        return list(each) if isinstance(value, list) else tuple(each)
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) > _MOST:
        return math.inf if value > 0 else -math.inf
    if isinstance(value, bool | int | float | str):
        return value
    return float(value) if isinstance(value, Real) else value


def whole(value: object) -> int | None:
    """A whole number as Python has it; None for what is none, as truths are."""
    try:
        return None if isinstance(value, bool) else operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        return None


def check_known(kind: str, name: object, known: Collection[str], field: str) -> None:
    """Raise UnknownNameError where the name is none of the known ones."""
    if not isinstance(name, str) or name not in known:
        raise unknown_name(kind, name, known, field=field)


def _keys(name: str, given: object) -> tuple[str, ...]:
    if given is None:
        return ()
    if isinstance(given, str):
        raise ParameterError(
            f"Expected {name} to be a list of keys, got the text {given!r}. Write [{given!r}].", field=name
        )
    if not isinstance(given, Iterable):
        raise ParameterError(
            f"Expected {name} to be a list of keys, got {given!r}. Write it like ['lambert.kd'].", field=name
        )
    found = tuple(given)
    for key in found:
        if not isinstance(key, str):
            raise ParameterError(
                f"Expected {name} to be a list of keys, got {key!r} in it. Write it like ['lambert.kd'].", field=name
            )
    return found


def _values(name: str, given: object) -> dict[Any, Any]:
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        what, example = {
            "fixed": ("values", "{'lambert.kd': 0.2}"),
            "bounds": ("(low, high)", "{'lambert.kd': (0.1, 0.3)}"),
        }[name]
        raise ParameterError(
            f"Expected {name} to be a mapping of keys to {what}, got {type(given).__name__}. Pass a dict like "
            f"{example}.",
            field=name,
        )
    return {key: plain(value) for key, value in given.items()}


def _starts(given: object) -> tuple[dict[Any, Any], ...]:
    if given is None:
        return ()
    found = tuple(given) if isinstance(given, Iterable) else (given,)
    for one in found:
        if not isinstance(one, Mapping):
            where = " in it" if isinstance(given, Iterable) else ""
            raise ParameterError(
                f"Expected starts to be a list of mappings of keys to values, got {type(one).__name__}{where}. "
                "Pass [{key: value, ...}, ...].",
                field="starts",
            )
    return tuple({key: plain(value) for key, value in one.items()} for one in found)
