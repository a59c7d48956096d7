"""A study as files and as text: the table and the sentence, JSON with all numbers, and the plots as SVG."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..plots import to_bytes
from ..plots.accuracy import accuracy
from ..plots.curves import curves
from ._study import Cell, Chart, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def text(study: Study) -> str:
    """The study as plain text: question, table, sentence, notes, and what made it."""
    lines = [f"{study.name}: {study.question}", "", *_table(study.columns, study.rows), "", study.sentence]
    lines += [f"- {note}" for note in study.notes]
    made = study.provenance
    if made:
        packages = ", ".join(f"{name} {number}" for name, number in made["versions"].items() if number)
        machine, threads = made["machine"], made["threads"]
        lines.append(
            f"{made['seconds']:.1f} s on {machine['cpu']}, {machine['cores']} cores, {threads} thread; {packages}; "
            f"seed {made['seed']}; {made['date']}"
        )
    return "\n".join(lines)


def to_dict(study: Study) -> dict[str, Any]:
    """The study as JSON-able data; null stands where there is no number."""
    return {
        "study": study.name,
        "question": study.question,
        "sentence": study.sentence,
        "notes": list(study.notes),
        "columns": list(study.columns),
        "rows": [[_plain(cell) for cell in row] for row in study.rows],
        "plots": [_chart(chart) for chart in study.charts],
        "pictures": [{"name": picture.name, "title": picture.title} for picture in study.pictures],
        "provenance": study.provenance,
    }


def figure(chart: Chart) -> "Figure":
    """The plot."""
    if chart.kind == "accuracy":
        return accuracy(chart.panels, chart.title, chart.x, chart.y, columns=chart.columns)
    return curves(chart.panels, chart.title, chart.x, chart.y, equal=chart.kind == "lobes")


def write(study: Study, folder: Path) -> list[Path]:
    """The files that were written into the folder, made where it is missing: text, JSON, plots and pictures.

    They replace files of the same names, which an earlier run of the same study left.
    """
    folder.mkdir(parents=True, exist_ok=True)
    files = {
        f"{study.name}.txt": (text(study) + "\n").encode(),
        f"{study.name}.json": (json.dumps(to_dict(study), indent=2, allow_nan=False) + "\n").encode(),
        **{f"{chart.name}.svg": to_bytes(figure(chart), "svg") for chart in study.charts},
        **{f"{picture.name}.svg": to_bytes(picture.figure, "svg") for picture in study.pictures},
    }
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return [folder / name for name in files]


def _table(columns: Sequence[str], rows: Sequence[Sequence[Cell]]) -> list[str]:
    """The table's lines; words to the left, numbers to the right."""
    cells = [[_cell(cell) for cell in row] for row in rows]
    right = [all(not isinstance(row[i], str) for row in rows) for i in range(len(columns))]
    widths = [max(len(row[i]) for row in [columns, *cells]) for i in range(len(columns))]

    def line(row: Sequence[str]) -> str:
        parts = (cell.rjust(w) if r else cell.ljust(w) for cell, w, r in zip(row, widths, right, strict=True))
        return "  ".join(parts).rstrip()

    return [line(columns), "  ".join("-" * width for width in widths), *(line(row) for row in cells)]


def _cell(cell: Cell) -> str:
    match cell:
        case None:
            return "-"
        case bool():
            return "yes" if cell else "no"
        case float():
            return f"{cell:.4g}"
    return str(cell)


def _plain(cell: Cell) -> Cell:
    return None if isinstance(cell, float) and not math.isfinite(cell) else cell


def _chart(chart: Chart) -> dict[str, Any]:
    panels = [
        {
            "title": panel.title,
            "curves": [
                {"label": c.label, "x": [_plain(v) for v in c.x], "y": [_plain(v) for v in c.y]} for c in panel.curves
            ],
            "levels": [{"label": label, "y": _plain(y)} for label, y in panel.levels],
        }
        for panel in chart.panels
    ]
    return {
        "name": chart.name,
        "title": chart.title,
        "kind": chart.kind,
        "x": chart.x,
        "y": chart.y,
        "panels": panels,
    }
