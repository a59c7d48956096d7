"""`brdf render SCENE`: the image of a scene, and the plan by which it was made."""

import dataclasses
import json
from pathlib import Path
from typing import Annotated

import typer

from ._bar import with_bar


def command(
    scene: Annotated[
        str | None, typer.Argument(help="A scene's JSON file, or the name of a shipped one.", show_default=False)
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="A .png, or linear .exr or .npy; by default SCENE.png.", show_default=False
        ),
    ] = None,
    tolerance: Annotated[float, typer.Option(help="Radiance that the plan may leave out.")] = 1e-3,
    samples: Annotated[int | None, typer.Option(help="Samples a pixel; by default the scene's.")] = None,
    noise: Annotated[float | None, typer.Option(help="Stop at this standard error; by default the scene's.")] = None,
    bounces: Annotated[int, typer.Option(help="Interreflections at most.")] = 32,
    force_on: Annotated[list[str] | None, typer.Option("--on", help="An effect to simulate; repeatable.")] = None,
    force_off: Annotated[list[str] | None, typer.Option("--off", help="An effect to leave out; repeatable.")] = None,
    seed: Annotated[int, typer.Option(help="Of the samples.")] = 0,
    device: Annotated[str, typer.Option(help="cpu or cuda.")] = "cpu",
    contours: Annotated[
        Path | None,
        typer.Option(help="Also draw lines of equal luminance over it, as .svg or .png.", show_default=False),
    ] = None,
    plan_only: Annotated[bool, typer.Option("--plan", help="Print the plan only.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Render a scene; print which effects were simulated, and why. Without a SCENE, list the shipped ones."""
    from .. import plots
    from ..render import SCENES, Scene, plan, render
    from ..render._checks import device as check_device
    from ..render.image import check_path

    if scene is None:
        typer.echo("\n".join(SCENES))
        return
    path = output or Path(f"{Path(scene).stem}.png")
    if contours is not None:
        plots.kind_of(contours)
    check_path(path)  # what cannot be written is refused before the work, not after it
    check_device(device)
    made = Scene.load(scene)
    changed = {name: value for name, value in (("samples", samples), ("noise", noise)) if value is not None}
    made = dataclasses.replace(made, **changed) if changed else made  # type: ignore[arg-type]
    force = dict.fromkeys(force_on or [], True) | dict.fromkeys(force_off or [], False)
    chosen = plan(made, tolerance, force, bounces)
    if not as_json:
        typer.echo(str(chosen))
    found = chosen.to_dict()
    if not plan_only:
        image = with_bar("render", lambda progress: render(made, chosen, seed=seed, device=device, progress=progress))
        image.save(path)
        if contours is not None:
            plots.save(plots.contours(image, title=Path(scene).stem), contours)
        noise_found = float(image.noise.square().mean().sqrt())
        found |= {"file": str(path), "seconds": image.seconds, "samples": image.samples, "noise": noise_found}
        if not as_json:
            sampled = f"{image.samples} samples a ray, noise {noise_found:.1e}" if image.samples else "nothing sampled"
            typer.echo(f"{path}: {image.seconds:.1f} s, {sampled}")
    if as_json:
        typer.echo(json.dumps(found, indent=2, allow_nan=False))
