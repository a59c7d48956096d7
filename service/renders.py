"""Rendered images on disk, each named by the hash of what made it: renders/<hash>.png, .npy and .exr."""

import hashlib
import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, get_args

import brdfcore as bc
from brdfcore.errors import BrdfError, InvalidValueError, unknown_name
from brdfcore.render import SCENES, Scene, plan, render

from .materials import real
from .schemas import RenderRequest

Kind = Literal["png", "npy", "exr"]
KINDS: tuple[Kind, ...] = get_args(Kind)
RAYS = 2**22  # of the camera, at most: 4 million pixels of one ray
PARTS = 64  # objects and lights together
COST = 2e10  # term evaluations and ray tests: about an hour of one core


def checked(asked: RenderRequest) -> dict[str, Any]:
    """What to show of a render's request; raises what can be told before the work."""
    scene = _scene(asked)
    rays = scene.camera.width * scene.camera.height * scene.camera.grid**2
    if rays > RAYS:
        raise InvalidValueError(
            f"Expected scene.camera to send at most {RAYS} rays, got {rays}, which is width times height times grid^2. "
            "Make the image smaller.",
            field="scene.camera",
        )
    parts = len(scene.objects) + len(scene.lights)
    if parts > PARTS:
        raise InvalidValueError(
            f"Expected scene to hold at most {PARTS} objects and lights, got {parts}. Leave some of them out.",
            field="scene.objects",
        )
    return {**asked.model_dump(), "samples": scene.samples, "noise": scene.noise}


def made(asked: RenderRequest, data: Path, progress: Callable[[float], None]) -> dict[str, Any]:
    """Facts about the image that was asked for, which is on disk afterwards."""
    scene = _scene(asked)
    chosen = plan(scene, asked.tolerance)
    if chosen.cost > COST:
        raise InvalidValueError(
            f"Expected the image to cost at most {COST:.0e} term evaluations and ray tests, got {chosen.cost:.1e}. "
            "Ask for fewer pixels or samples, or for a larger tolerance.",
            field="samples",
        )
    image = render(scene, chosen, seed=asked.seed, progress=progress)
    name = _hash(scene, asked)
    (data / "renders").mkdir(exist_ok=True)
    for kind in KINDS:
        draft = image.save(_path(data, f"{name}.{os.getpid()}", kind))
        draft.replace(_path(data, name, kind))  # whole or not at all, also where two jobs make the same
    return {
        "hash": name,
        "version": bc.__version__,
        "seed": asked.seed,
        "width": scene.camera.width,
        "height": scene.camera.height,
        "plan": chosen.to_dict(),
        "table": str(chosen),
        "samples": image.samples,
        "noise": float(image.noise.square().mean().sqrt()),
        "seconds": image.seconds,
    }


def content(data: Path, name: str, kind: Kind) -> bytes | None:
    """A kept image as the bytes of its file; None where there is none."""
    try:
        return _path(data, name, kind).read_bytes()
    except FileNotFoundError:
        return None


def remove(data: Path, name: str) -> None:
    """Remove a kept image."""
    for kind in KINDS:
        _path(data, name, kind).unlink(missing_ok=True)


def _path(data: Path, name: str, kind: str) -> Path:
    return data / "renders" / f"{name}.{kind}"


def _scene(asked: RenderRequest) -> Scene:
    """The scene, with the samples and the noise that are asked for; an error names its field as the body does."""
    try:
        if isinstance(asked.scene, dict):
            scene = Scene.from_json(_with_reals(asked.scene))
        elif asked.scene in SCENES:  # never a path
            scene = Scene.load(asked.scene)
        else:
            raise unknown_name("a scene", asked.scene, SCENES, field="scene")
    except BrdfError as error:
        if error.field != "scene":
            error.field = f"scene.{error.field}" if error.field else "scene"
        raise
    given = {"samples": asked.samples, "noise": asked.noise}
    return replace(scene, **{name: value for name, value in given.items() if value is not None})  # type: ignore[arg-type]


def _with_reals(data: dict[str, Any]) -> dict[str, Any]:
    """A scene's JSON with the numbers of its materials real; those of pixels stay whole."""
    objects = data.get("objects")
    if not isinstance(objects, list):
        return data
    changed = [
        {**one, "material": real(one["material"])} if isinstance(one, dict) and "material" in one else one
        for one in objects
    ]
    return {**data, "objects": changed}


def _hash(scene: Scene, asked: RenderRequest) -> str:
    """The hash of all that determines the image."""
    determined = [bc.__version__, scene.to_json(), asked.tolerance, asked.seed]
    return hashlib.sha256(json.dumps(determined, sort_keys=True).encode()).hexdigest()
