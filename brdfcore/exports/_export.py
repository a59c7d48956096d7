"""What an export is, what a format to export to is, and the comment that every exported file begins with."""

import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from ..errors import InvalidValueError
from ..models.material import Material
from ._difference import EXACT


@dataclass(frozen=True)
class Export:
    """A material in another program's form, and how far that is from the material.

    content     the file's content
    difference  relative root mean square of (f' - f) cos theta_i [1] (_difference.py); 0 where nothing is lost
    exact       whether that is rounding alone; else `holds` says what the file holds instead
    holds       what the file holds, in a sentence
    path        where it was written, if it was
    """

    format: str
    content: str | bytes
    difference: float
    holds: str
    path: Path | None = None

    @property
    def exact(self) -> bool:
        """Whether the file holds the material itself, but for rounding."""
        return self.difference <= EXACT

    def to_bytes(self) -> bytes:
        """The file's content as it is written."""
        return self.content if isinstance(self.content, bytes) else self.content.encode("utf-8")


Orientation = tuple[float, float, float]


@dataclass(frozen=True)
class Exporter:
    """One form to export to.

    name         what `export(format=...)` takes
    description  one line: the file, and which materials it holds exactly
    suffix       that such files have
    media_type   for HTTP
    write        the export of (material, identifier, orientation or None)
    oriented     whether the file says where the material's x axis points, so that an orientation can be given
    """

    name: str
    description: str
    suffix: str
    media_type: str
    write: Callable[[Material, str, Orientation | None], Export]
    oriented: bool = False


def provenance() -> str:
    """What wrote the file."""
    return f"brdfcore {version('brdfcore')}"


def told(difference: float) -> str:
    """The difference in words."""
    if difference <= EXACT:
        return f"exact: relative RMS difference of f cos theta_i {difference:.1e}"
    return f"not exact: relative RMS difference of f cos theta_i {difference:.4g} ({100 * difference:.2g} %)"


def comment(material: Material, holds: str, difference: float, mark: str) -> str:
    """The lines that begin a text file, each after `mark`: what it holds, the material's text, how far it is off."""
    paragraphs = [
        f"{holds} Written by {provenance()}.",
        f"material: {material}",
        f"{told(difference)}, over directions within 85 degrees of the normal",
    ]
    lines = [line for paragraph in paragraphs for line in textwrap.wrap(paragraph, 110, break_long_words=False)]
    return "".join(f"{mark} {line}\n" for line in lines)


def check_channels(count: int) -> None:
    """Raise InvalidValueError for what a renderer's colours cannot hold."""
    if count not in (1, 3):
        raise InvalidValueError(
            f"Expected the material to have one channel or three, red, green and blue, got {count}. "
            "Fit its spectrum as red, green and blue (brdf fit --rgb, bc.read(..., rgb=True), "
            "POST /v1/datasets?rgb=true), or export it as json.",
            field="material",
        )
