"""The material that a request means."""

from typing import Any

import brdfcore as bc
from brdfcore.errors import BrdfError


def material_of(given: str | dict[str, Any]) -> bc.Material:
    """The material of a text, a preset's name or a material's JSON; an error names its field as the body does."""
    try:
        return bc.material(given) if isinstance(given, str) else bc.Material.from_json(real(given))
    except BrdfError as error:
        if error.field in (None, "model"):
            error.field = "material"
        raise


def real(given: Any) -> Any:
    """A material's JSON with every whole number as a real one: JavaScript writes 1.0 as 1."""
    if isinstance(given, dict):
        return {key: real(value) for key, value in given.items()}
    if isinstance(given, list):
        return [real(value) for value in given]
    return float(given) if type(given) is int else given
