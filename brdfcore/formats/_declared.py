"""What a file says and what the caller says of it, made one; a disagreement or a silence is an error, never a guess."""

from collections.abc import Sequence

from ..errors import FormatError, unknown_name
from ._text import brief


def declared(field: str, known: Sequence[str], in_file: str | None, argument: str | None, how: str) -> str:
    """The one declared name; `how` tells the user how to declare it in this format.

    The caller has checked that the argument is among the known names.
    """
    if in_file is not None and in_file not in known:
        raise unknown_name(field, brief(in_file)[1:-1], known, field=field)
    if in_file is not None and argument is not None and in_file != argument:
        raise FormatError(
            f"Expected {field} to be {in_file!r} as the file has it, got {argument!r} as the argument. "
            "Drop the argument, or correct the file.",
            field=field,
        )
    name = in_file or argument
    if name is None:
        listed = ", ".join(repr(k) for k in known)
        raise FormatError(f"Expected {field} to be declared ({listed}), got nothing. {how}", field=field)
    return name
