"""`brdf models [NAME]`: what models there are, with equations, options and boxes, all read from the code."""

import json
from typing import Annotated, Any

import typer


def command(
    name: Annotated[str | None, typer.Argument(help="A model, to see all of it.", show_default=False)] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """List the models, or print one whole: equation, source, options and parameters with their boxes."""
    from rich import box
    from rich.console import Console
    from rich.table import Column, Table

    from ..errors import unknown_name
    from ..models import MODELS

    if name is not None and name not in MODELS:
        raise unknown_name("a model", name, MODELS, field="name")
    if as_json:
        described: Any = [model.describe() for model in MODELS.values()] if name is None else MODELS[name].describe()
        typer.echo(json.dumps(described, indent=2))
        return
    console = Console(highlight=False)
    if name is None:
        table = Table(Column("name", no_wrap=True), "what it is", "options", "parameters", box=box.SIMPLE)
        for model in MODELS.values():
            facts = model.describe()
            options = ", ".join(" | ".join(group) for group in facts["options"])
            table.add_row(facts["name"], facts["summary"], options, ", ".join(p["name"] for p in facts["parameters"]))
        console.print(table)
        return
    facts = MODELS[name].describe()
    console.print(facts["text"], markup=False, soft_wrap=True)
    if facts["options"]:
        console.print("\nOptions: " + "; ".join(" | ".join(group) for group in facts["options"]), markup=False)
    fixed = (Column(name, no_wrap=True) for name in ("parameter", "box", "default"))
    table = Table(*fixed, "per channel", "where", Column("what it is", overflow="fold"), box=box.SIMPLE)
    for p in facts["parameters"]:
        where = ", ".join(p["where"]) or "always"
        table.add_row(
            p["name"],
            p["box"].replace("[", "\\["),
            f"{p['default']:g}",
            p["per_channel"],
            where,
            p["description"].replace("[", "\\["),
        )
    console.print(table)
