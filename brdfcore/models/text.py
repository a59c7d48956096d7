"""Reads a material's text: terms joined by "+", each with options, values and ties in brackets.

    material  = term {"+" term}
    term      = NAME ["(" [argument {"," argument}] ")"]
    argument  = WORD                                an option
              | NAME "=" number                     a value
              | NAME "=" "[" number {"," number} "]"     a value a channel
              | NAME "=" LABEL "." NAME             a tie: the other term's parameter serves here too
              | NAME "=" number-or-list "-" LABEL "." NAME   a tie to a known total, as kd = rho - rs

Labels are the models' names; the second `kurt` of a material is `kurt_2`. What the names mean is form.py's affair, but
for one: a text that is the bare name of a preset is read as the preset's text.
"""

import re
from dataclasses import dataclass

from ..errors import ModelTextError
from .presets import PRESETS

_TOKEN = re.compile(
    r"\s*(?:(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[A-Za-z_]\w*)|(?P<mark>[-+(),=\[\].]))"
)
_AFTER_VALUE = re.compile(r"\s*-")
_EXAMPLE = "Write it like 'lambert(kd=0.2) + ward_bounded(isotropic, rs=0.05, a=0.03)'."


@dataclass(frozen=True)
class Tie:
    """A parameter that another term's parameter determines: owner's value, or total minus it."""

    owner: str  # "label.name"
    total: tuple[float, ...] | None = None  # one number, or one a channel


Argument = float | tuple[float, ...] | Tie


@dataclass(frozen=True)
class ParsedTerm:
    """A term as it was written."""

    name: str
    words: tuple[str, ...]
    arguments: dict[str, Argument]

    @property
    def bare(self) -> bool:
        """Whether it is a name and nothing else."""
        return not self.words and not self.arguments


class _Reader:
    """A cursor over the text."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0

    def fail(self, expected: str) -> ModelTextError:
        rest = self.text[self.at :].lstrip()
        got = f"{rest.rstrip()[:20]!r} at character {len(self.text) - len(rest) + 1}" if rest else "the end of the text"
        return ModelTextError(f"Expected {expected} in the model {self.text!r}, got {got}. {_EXAMPLE}", field="model")

    def take(self, kind: str, value: str | None = None) -> str | None:
        match = _TOKEN.match(self.text, self.at)
        if match is None or match.lastgroup != kind or (value is not None and match[kind] != value):
            return None
        self.at = match.end()
        return match[kind]

    def require(self, kind: str, expected: str, value: str | None = None) -> str:
        taken = self.take(kind, value)
        if taken is None:
            raise self.fail(expected)
        return taken

    def numbers(self) -> tuple[float, ...] | None:
        if (number := self.take("number")) is not None:
            return (float(number),)
        if not self.take("mark", "["):
            return None
        values = [float(self.require("number", "a number"))]
        while self.take("mark", ","):
            values.append(float(self.require("number", "a number")))
        self.require("mark", "',' or ']'", "]")
        return tuple(values)

    def reference(self) -> str:
        label = self.require("name", "a value, or another term's parameter such as kurt.f0")
        self.require("mark", f"'.' after {label}", ".")
        return f"{label}.{self.require('name', f'a parameter of {label}')}"

    def value(self) -> Argument:
        is_list = _TOKEN.match(self.text, self.at)
        numbers = self.numbers()
        if numbers is None:
            return Tie(self.reference())
        if _AFTER_VALUE.match(self.text, self.at):
            self.require("mark", "'-'", "-")
            return Tie(self.reference(), total=numbers)
        return numbers if is_list is not None and is_list["mark"] == "[" else numbers[0]

    def term(self) -> ParsedTerm:
        name = self.require("name", "a model's name")
        words: list[str] = []
        arguments: dict[str, Argument] = {}
        if self.take("mark", "("):
            while not self.take("mark", ")"):
                if words or arguments:
                    self.require("mark", "',' or ')'", ",")
                key = self.require("name", "an option or a parameter")
                if key in words or key in arguments:
                    raise ModelTextError(
                        f"Expected each argument of {name} once, got {key} twice. Keep one.", field="model"
                    )
                if self.take("mark", "="):
                    arguments[key] = self.value()
                else:
                    words.append(key)
        return ParsedTerm(name, tuple(words), arguments)


def parse(text: str) -> list[ParsedTerm]:
    """The terms that the text, or the preset that it names, consists of; raises ModelTextError where it is neither."""
    if not isinstance(text, str):
        raise ModelTextError(f"Expected the model to be a text, got {type(text).__name__}. {_EXAMPLE}", field="model")
    reader = _Reader(text)
    terms = [reader.term()]
    while reader.take("mark", "+"):
        terms.append(reader.term())
    if text[reader.at :].strip():
        raise reader.fail("'+' or the end")
    preset = next((PRESETS[term.name] for term in terms if term.name in PRESETS), None)
    if preset is None:
        return terms
    if len(terms) > 1 or not terms[0].bare:
        raise ModelTextError(
            f"Expected the preset {preset.name} to stand alone, got {text!r}. Write its text instead: {preset.text!r}.",
            field="model",
        )
    return parse(preset.text)


def number_text(values: tuple[float, ...] | float) -> str:
    """A value as the text form writes it, to 12 digits."""
    if isinstance(values, tuple):
        return "[" + ", ".join(f"{value:.12g}" for value in values) + "]"
    return f"{values:.12g}"
