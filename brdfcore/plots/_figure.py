"""What all figures share: how they look, and how they are written."""

import io
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from ..errors import InvalidValueError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Okabe and Ito 2008: told apart by people with any colour vision
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")

_STYLE: Any = {
    "svg.hashsalt": "brdfcore",  # the same figure is the same file
    "svg.fonttype": "none",  # text stays text
}


def new_figure(width: float, height: float) -> "Figure":
    """An empty figure of a size in inches, without pyplot's global state."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height))


def to_bytes(figure: "Figure", kind: Literal["svg", "png"]) -> bytes:
    """The figure as an SVG or PNG file's content."""
    import matplotlib

    buffer = io.BytesIO()
    metadata = {"Date": None} if kind == "svg" else None
    with matplotlib.rc_context(_STYLE):
        figure.savefig(buffer, format=kind, dpi=150, metadata=metadata)
    return buffer.getvalue()


def save(figure: "Figure", path: str | Path) -> Path:
    """The path of the file that the figure was written to; SVG or PNG by its suffix."""
    path = Path(path)
    path.write_bytes(to_bytes(figure, kind_of(path)))
    return path


def kind_of(path: Path) -> Literal["svg", "png"]:
    """The kind of file that a path asks for; InvalidValueError for another suffix or a folder that is missing."""
    if not path.parent.is_dir():
        raise InvalidValueError(
            f"Expected the plot's folder to exist, got {str(path.parent)!r}. Make it first.", field="path"
        )
    match path.suffix.lower():
        case ".svg":
            return "svg"
        case ".png":
            return "png"
    raise InvalidValueError(
        f"Expected the plot's file to end in .svg or .png, got {path.suffix or 'no suffix'!r}. Rename it.", field="path"
    )
