"""What a model declares: options, parameters, the geometry it needs, and how its value is linear.

    f(wi, wo) = sum over k of basis_k(shape; wi, wo) * coefficient_k(reflectances)         [1/sr]

The bases are shared by all channels, the coefficients hold the colour, and both are pure functions, so that one small
matrix product evaluates a material of any number of terms and channels.
"""

import inspect
import itertools
from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import Any, ClassVar

from torch import Tensor

from ..errors import ModelTextError, unknown_name
from ..geometry import Geometry
from ..parameters import Parameter, Values


class Model(ABC):
    """A lobe or a diffuse term, with its options chosen: one word of each group, the first of a group the default."""

    name: ClassVar[str]
    option_groups: ClassVar[tuple[tuple[str, ...], ...]] = ()
    reciprocal: ClassVar[bool] = True

    def __init__(self, options: Sequence[str] = ()) -> None:
        self.options = tuple(
            next((word for word in group if word in options), group[0]) for group in self.option_groups
        )

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and other.options == self.options

    def __hash__(self) -> int:
        return hash((self.name, self.options))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.options})"

    @property
    @abstractmethod
    def scale(self) -> str:
        """The reflectance of which f is a multiple where all else is held; not a parameter's name where none is."""

    @property
    @abstractmethod
    def parameters(self) -> tuple[Parameter, ...]:
        """The parameters that the chosen options declare, in the order of the text form."""

    @property
    @abstractmethod
    def needs(self) -> frozenset[str]:
        """The quantities of the geometry that the bases read."""

    @property
    @abstractmethod
    def pdf_needs(self) -> frozenset[str]:
        """The quantities of the geometry that the density reads."""

    @abstractmethod
    def basis(self, values: Values, g: Geometry) -> tuple[Tensor, ...]:
        """The bases [1/sr], each (..., 1), without their coefficients."""

    @abstractmethod
    def coefficients(self, values: Values) -> tuple[Tensor, ...]:
        """The coefficient of each basis [1], each () or (C,)."""

    @property
    @abstractmethod
    def typical_albedo(self) -> tuple[float, ...]:
        """About what each basis reflects for a coefficient of 1 [1]; decides how samples are shared among terms."""

    @abstractmethod
    def sample(self, values: Values, wo: Tensor, u: Tensor) -> Tensor:
        """Directions wi (..., 3) for wo (..., 3) above the horizon and u (..., 2) uniform in [0, 1)."""

    @abstractmethod
    def pdf(self, values: Values, g: Geometry) -> Tensor:
        """The density of `sample` per solid angle [1/sr], (..., 1)."""

    @cached_property
    def parameter(self) -> dict[str, Parameter]:
        """The declared parameters by name."""
        return {parameter.name: parameter for parameter in self.parameters}

    @classmethod
    def with_words(cls, words: Sequence[str], names: Sequence[str] = ()) -> list["Model"]:
        """Every choice of options that holds the given words and declares the given parameters, defaults first.

        Raises UnknownNameError for a word or parameter that no choice knows, ModelTextError for a contradiction.
        """
        known_words = [word for group in cls.option_groups for word in group]
        for word in words:
            if word not in known_words:
                raise unknown_name(f"an option of {cls.name}", word, known_words, field="model")
        for group in cls.option_groups:
            chosen = [word for word in words if word in group]
            if len(chosen) > 1:
                raise ModelTextError(
                    f"Expected one of {', '.join(group)} for {cls.name}, got {' and '.join(chosen)}. Keep one.",
                    field="model",
                )
        choices = [cls(choice) for choice in itertools.product(*cls.option_groups)]
        known = list(dict.fromkeys(name for choice in choices for name in choice.parameter))
        for name in names:
            if name not in known:
                raise unknown_name(f"a parameter of {cls.name}", name, known, field="model")
        fitting = [m for m in choices if set(words) <= set(m.options) and set(names) <= set(m.parameter)]
        if not fitting:
            offered = "; ".join(
                f"{cls.name}({', '.join(m.options)}) has {', '.join(m.parameter)}"
                for m in choices
                if set(words) <= set(m.options)
            )
            raise ModelTextError(
                f"Expected the options and parameters of {cls.name} to agree, got {', '.join([*words, *names])}. "
                f"Drop one of them: {offered}.",
                field="model",
            )
        return fitting

    @classmethod
    def describe(cls) -> dict[str, Any]:
        """What the model is, as JSON-able facts taken from its file and its declarations."""
        text = inspect.getdoc(inspect.getmodule(cls)) or ""
        choices = [cls(choice) for choice in itertools.product(*cls.option_groups)]
        declared: dict[str, dict[str, Any]] = {}
        for choice in choices:
            for p in choice.parameters:
                entry = declared.setdefault(
                    p.name,
                    {
                        "name": p.name,
                        "description": p.description,
                        "box": p.box,
                        "low": p.low,
                        "high": p.high,
                        "default": p.default,
                        "scale": p.scale,
                        "per_channel": p.per_channel,
                        "where": [],
                    },
                )
                entry["where"].append(list(choice.options))
        for entry in declared.values():  # the words without which the parameter is not declared
            common = set.intersection(*(set(where) for where in entry["where"])) if cls.option_groups else set()
            entry["where"] = [w for w in entry["where"][0] if w in common]
        return {
            "name": cls.name,
            "summary": text.partition("\n")[0],
            "text": text,
            "options": [list(group) for group in cls.option_groups],
            "parameters": list(declared.values()),
            "reciprocal": cls.reciprocal,
        }
