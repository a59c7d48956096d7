"""What a model declares: options, parameters, the geometry it needs, and how its value is linear.

    f(wi, wo) = sum over k of basis_k(shape; wi, wo) * coefficient_k(reflectances)         [1/sr]

Bases are (..., 1), shared by all channels, and the coefficients hold the colour, so that one small matrix product
evaluates a material of any number of terms and channels. A basis whose shape has colour itself, through an index of
refraction with one value a channel, is (..., C). All are pure functions.
"""

import functools
import inspect
import itertools
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

from torch import Tensor

from ..errors import ModelTextError, unknown_name
from ..geometry import Geometry
from ..parameters import Parameter, Values


class Model(ABC):
    """A lobe or a diffuse term, with its options chosen: one word of each group, the first of a group the default."""

    name: ClassVar[str]
    good_for: ClassVar[str]  # one short sentence in plain words: surfaces that it suits, and where it does not
    option_groups: ClassVar[tuple[tuple[str, ...], ...]] = ()
    apart: ClassVar[tuple[tuple[str, str], ...]] = ()  # pairs of options of which a choice holds one at most
    reciprocal: ClassVar[bool] = True

    def __init__(self, options: Sequence[str] = ()) -> None:
        self.options = tuple(
            next((word for word in group if word in options), group[0]) for group in self.option_groups
        )
        self.check_together(self.options)

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
        """The bases [1/sr] without their coefficients, each (..., 1), or (..., C) where its shape has colour."""

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

    @functools.cached_property
    def parameter(self) -> dict[str, Parameter]:
        """The declared parameters by name."""
        return {parameter.name: parameter for parameter in self.parameters}

    @classmethod
    @functools.cache
    def choices(cls) -> tuple["Model", ...]:
        """Every choice of options that go together, defaults first."""
        every = itertools.product(*cls.option_groups)
        return tuple(cls(words) for words in every if not any(set(pair) <= set(words) for pair in cls.apart))

    @classmethod
    def check_together(cls, words: Sequence[str]) -> None:
        """Raise ModelTextError where two of the words do not go together."""
        for pair in cls.apart:
            if set(pair) <= set(words):
                raise ModelTextError(
                    f"Expected {pair[0]} or {pair[1]} for {cls.name}, got both, which do not go together. Drop one.",
                    field="model",
                )

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
        cls.check_together(words)
        choices = cls.choices()
        known = list(dict.fromkeys(name for choice in choices for name in choice.parameter))
        for name in names:
            if name not in known:
                raise unknown_name(f"a parameter of {cls.name}", name, known, field="model")
        fitting = [m for m in choices if set(words) <= set(m.options) and set(names) <= set(m.parameter)]
        if not fitting:
            belongs = "; ".join(f"{name} belongs to {where}" for name in names if (where := cls._declared_by(name)))
            raise ModelTextError(
                f"Expected the options and parameters of {cls.name} to agree, got {', '.join([*words, *names])}. "
                f"Drop one of them: {belongs}.",
                field="model",
            )
        return fitting

    @classmethod
    def describe(cls) -> dict[str, Any]:
        """What the model is, as JSON-able facts taken from its file and its declarations.

        A parameter that options declare differently has an entry for each declaration. Its `where` holds the words that
        declare it, any one of those that exclude each other; where it is empty, all do.
        """
        text = inspect.getdoc(inspect.getmodule(cls)) or ""
        declared = dict.fromkeys(p for choice in cls.choices() for p in choice.parameters)
        return {
            "name": cls.name,
            "good_for": cls.good_for,
            "summary": text.partition("\n")[0],
            "text": text,
            "options": [list(group) for group in cls.option_groups],
            "parameters": [
                {
                    "name": p.name,
                    "description": p.description,
                    "box": p.box,
                    "low": p.low,
                    "high": p.high,
                    "default": p.default,
                    "scale": p.scale,
                    "per_channel": p.per_channel,
                    "where": cls._where(p),
                }
                for p in declared
            ],
            "reciprocal": cls.reciprocal,
        }

    @classmethod
    def _declared_by(cls, name: str) -> str:
        """The options that declare a parameter of this name, in words; empty where all do."""
        declared = {p for choice in cls.choices() for p in choice.parameters if p.name == name}
        words = {word for p in declared for word in cls._where(p)}
        told = (" or ".join(word for word in group if word in words) for group in cls.option_groups)
        return " and ".join(filter(None, told))

    @classmethod
    def _where(cls, parameter: Parameter) -> list[str]:
        """The words that declare a parameter, of those groups without which others would be told to declare it."""
        declaring = [choice for choice in cls.choices() if parameter in choice.parameters]
        words = {word for choice in declaring for word in choice.options}
        groups = list(cls.option_groups)
        for group in cls.option_groups:
            fewer = [other for other in groups if other is not group]
            told = [c for c in cls.choices() if all(words & set(c.options) & set(other) for other in fewer)]
            groups = fewer if told == declaring else groups
        return [word for group in groups for word in group if word in words]
