"""The package's exceptions, all of which carry one sentence for the user.

    BrdfError
    |-- InvalidValueError (ValueError)      a value that breaks a stated rule
    |   |-- ParameterError                  a model parameter outside its box, or of the wrong shape
    |   |-- ModelTextError                  a model's text that cannot be read, or contradicts itself
    |   |-- SamplesError                    measured samples that are no reflectance measurement
    |   `-- FormatError                     a file that is not what it should be, or that leaves something undeclared
    `-- UnknownNameError (KeyError)         a name that no registry holds; lists the known ones and the nearest

A message reads "Expected <name> to be <rule>, got <value>. <What to do>."
"""

import difflib
from collections.abc import Iterable


class BrdfError(Exception):
    """Base of every error that this package raises on purpose; `field` names the input at fault, where there is one."""

    def __init__(self, message: str, *, field: str | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.field = field

    def __str__(self) -> str:
        """The sentence itself (KeyError would print it in quotes)."""
        return self.message


class InvalidValueError(BrdfError, ValueError):
    """A value that breaks a stated rule."""


class ParameterError(InvalidValueError):
    """A model parameter outside its box, or of the wrong shape."""


class ModelTextError(InvalidValueError):
    """A model's text that cannot be read, or that contradicts itself."""


class SamplesError(InvalidValueError):
    """Measured samples that are no reflectance measurement."""


class FormatError(InvalidValueError):
    """A file that is not what it should be, or that leaves something undeclared."""


class UnknownNameError(BrdfError, KeyError):
    """A name that no registry holds."""


def unknown_name(kind: str, name: object, known: Iterable[str], *, field: str | None = None) -> UnknownNameError:
    """The error for a name that is not among the known ones; it names the nearest and lists all."""
    names = list(known)
    nearest = difflib.get_close_matches(str(name), names, n=1)
    hint = f"Did you mean {nearest[0]!r}? " if nearest else ""
    listed = f"Known: {', '.join(names)}." if names else "There are none; leave it out."
    return UnknownNameError(f"Expected {kind} to be a known name, got {name!r}. {hint}{listed}", field=field)
