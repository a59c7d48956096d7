"""What `brdf check --hard-cases` prints: the errors of equations as printed beside the library's, case by case."""

import json
import math
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from ..hard_cases import CaseReport, ModelReport

WIDTH = 100  # characters, where the terminal has as many


def check(name: str | None, *, as_json: bool) -> bool:
    """Whether a model, or every model, is within its bars; prints each report as soon as it is there."""
    from ..errors import unknown_name
    from ..hard_cases import check as check_model
    from ..models import MODELS

    if name is not None and name not in MODELS:
        raise unknown_name("a model", name, MODELS, field="material")
    models = list(MODELS.values()) if name is None else [MODELS[name]]
    if as_json:
        reports = [check_model(model) for model in models]
        found = [report.to_dict() for report in reports]
        typer.echo(json.dumps({"items": found} if name is None else found[0], indent=2))
        return not any(report.missed for report in reports)
    console = _console()
    console.print(
        "Relative errors against 160 digits, the worst of each case: f first, below it its gradient.\n"
        "Textbook is the equation as printed, angles by acos and atan2; ours is what brdfcore computes.\n",
        style="dim",
    )
    reports = []
    for model in models:
        with console.status(f"{model.name} ..."):
            reports.append(check_model(model))
        _print(console, reports[-1])
    if name is None:
        cases, broken = sum(len(report.cases) for report in reports), sum(report.broken for report in reports)
        missed = [report.model.name for report in reports if report.missed]
        verdict = f"{', '.join(missed)} missed their bars" if missed else "ours are all within their bars"
        console.print(f"{len(reports)} models, {cases} cases: as printed, {broken} break; {verdict}.")
    refused = {dtype: answer for report in reports for dtype, answer in report.refusals.items() if answer}
    console.print("\n".join(f"{dtype} is refused: {answer}" for dtype, answer in refused.items()), markup=False)
    return not any(report.missed for report in reports)


def _console() -> "Console":
    from rich.console import Console

    console = Console(highlight=False)
    console.width = min(console.width, WIDTH) if console.is_terminal else WIDTH
    return console


def _print(console: "Console", report: "ModelReport") -> None:
    """The table of a model and what it comes to."""
    from rich import box
    from rich.table import Column, Table

    name = report.model.name
    numbers = ("textbook\nfloat32", "\nfloat64", "ours\nfloat32", "\nfloat64")
    table = Table(
        Column("case, and why it is hard", ratio=1),
        *(Column(header, justify="right", no_wrap=True) for header in numbers),
        title=f"{name}: {report.model.describe()['summary']}",
        title_justify="left",
        title_style="bold",
        box=box.SIMPLE,
        expand=True,
    )
    for case in report.cases:
        _add(table, case)
    console.print(table)
    broken = f"As printed, {report.broken} of {len(report.cases)} cases break: NaN, infinite, or more than 1 % off."
    if report.missed:
        console.print(f"{broken} Ours misses its bar:")
        console.print("\n".join(report.missed), style="bold red", markup=False)
        console.print()
        return
    single, double = (_shown(report.largest(precision)) for precision in ("float32", "float64"))
    console.print(
        f"{broken} Ours is off by at most {single} in float32 and {double} in float64, "
        f"{100 * report.share:.0f} % of what it may be.\n"
    )


def _add(table: "Table", case: "CaseReport") -> None:
    from rich.text import Text

    from ..hard_cases.report import BROKEN

    def column(whose: str, precision: str) -> "Text":
        lines = []
        for quantity in ("f", "gradient"):
            worst = case.worst[quantity, precision]
            error = worst.textbook if whose == "textbook" else worst.ours
            if whose == "textbook":
                style = "" if error <= BROKEN else "red"
            else:
                style = "green" if worst.share <= 1 else "bold red"
            lines.append(Text(_shown(error), style=style))
        return Text("\n").join(lines)

    title = Text.assemble(case.case.name, "\n", (case.case.why, "dim"))
    table.add_row(title, *(column(whose, p) for whose in ("textbook", "ours") for p in ("float32", "float64")))


def _shown(error: float) -> str:
    """A relative error: 2e-7, 26 %, 85x, NaN or Inf."""
    if not math.isfinite(error):
        return "NaN" if math.isnan(error) else "Inf"
    if 0.01 <= error < 10:
        return f"{100 * error:.0f} %"
    mantissa, _, exponent = f"{error:.0e}".partition("e")
    if error < 0.01:
        return f"{mantissa}e{int(exponent)}" if error > 1e-17 else "0"  # less than half a rounding
    return f"{error:.0f}x" if error < 1000 else f"{mantissa}e{int(exponent)}x"
