"""`brdf models [NAME]`: what models and presets there are, with equations, options and boxes, read from the code."""

import dataclasses
import json
from typing import Annotated, Any

import typer


def command(
    name: Annotated[str | None, typer.Argument(help="A model or preset, to see all of it.", show_default=False)] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """List the models and presets, or print one whole: equation, source, options and parameters with their boxes."""
    from rich import box
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Column, Table

    from ..errors import unknown_name
    from ..models import MODELS
    from ..models.presets import PRESETS

    if name is not None and name not in MODELS and name not in PRESETS:
        raise unknown_name("a model or preset", name, [*MODELS, *PRESETS], field="name")
    if as_json:
        models = {known: model.describe() for known, model in MODELS.items()}
        presets = {known: dataclasses.asdict(preset) for known, preset in PRESETS.items()}
        every: Any = {"items": list(models.values()), "presets": list(presets.values())}  # as GET /v1/models answers
        typer.echo(json.dumps(every if name is None else (models | presets)[name], indent=2))
        return
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = 120  # as wide as the models' texts
    if name is None:
        table = Table(Column("name", no_wrap=True), "good for", "options", "parameters", box=box.SIMPLE)
        for column in table.columns[1:]:
            column.overflow = "fold"  # no word is cut short
        for model in MODELS.values():
            facts = model.describe()
            options = ", ".join(" | ".join(group) for group in facts["options"])
            names = dict.fromkeys(p["name"] for p in facts["parameters"])
            table.add_row(facts["name"], facts["good_for"], options, ", ".join(names))
        console.print(table)
        table = Table(Column("preset", no_wrap=True), "what it is", "source", box=box.SIMPLE)
        for preset in PRESETS.values():
            table.add_row(preset.name, preset.summary, preset.source)
        console.print(table)
        return
    if name in PRESETS:
        preset = PRESETS[name]
        console.print(
            f"{preset.summary}\n\n    {preset.text}\n\nSource: {preset.source}.", markup=False, soft_wrap=True
        )
        return
    facts = MODELS[name].describe()
    console.print(f"{facts['text']}\n\nGood for: {facts['good_for']}", markup=False, soft_wrap=True)
    if facts["options"]:
        options = "; ".join(" | ".join(group) for group in facts["options"])
        console.print(f"\nOptions: {options}", markup=False, soft_wrap=True)
    fixed = (Column(title, no_wrap=True) for title in ("parameter", "box", "default"))
    table = Table(*fixed, "per channel", "where", Column("what it is", overflow="fold"), box=box.SIMPLE)
    for p in facts["parameters"]:
        words = (" or ".join(word for word in group if word in p["where"]) for group in facts["options"])
        where = ", ".join(filter(None, words)) or "always"
        table.add_row(
            p["name"], escape(p["box"]), f"{p['default']:g}", p["per_channel"], where, escape(p["description"])
        )
    console.print(table)
