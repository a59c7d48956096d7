"""A scene: shapes with materials, lights and a camera, and its JSON.

    {"camera": {"position": [3, 0, 1], "look_at": [0, 0, 0], "fov_deg": 30, "width": 64, "height": 64},
     "objects": [{"kind": "sphere", "center": [0, 0, 0], "radius": 1, "material": "lambert(kd=0.5)"}],
     "lights": [{"kind": "dome", "radiance": 1}]}

Lengths are in one unit of the user's choice, radiance in another; angles are in degrees, as their names say. A material
is a text, a preset's name, what Material.to_json returned, or a file of a measured grid, {"measured": "paint.bsdf"},
whose path starts at the scene's file. Objects with the same material's data share one material.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from ..errors import FormatError, InvalidValueError, unknown_name
from ..models.material import Material
from ..tabulated import Tabulated
from . import _checks, _json
from .camera import Camera
from .lights import Directional, Dome, Light, Point, RectangleLight, SphereLight
from .shapes import Plane, Rectangle, Shape, Sphere

SHAPES: dict[str, type[Shape]] = {"sphere": Sphere, "plane": Plane, "rectangle": Rectangle}
LIGHTS: dict[str, type[Light]] = {
    "directional": Directional,
    "point": Point,
    "rectangle": RectangleLight,
    "sphere": SphereLight,
    "dome": Dome,
}
SHIPPED = Path(__file__).parent / "scenes"


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """Shapes, lights and a camera; how many samples a ray gets, or the noise at which sampling stops; the exposure.

    samples   a pixel's, at most; noise stops earlier
    noise     root mean square over the pixels of their standard errors [radiance], None to take all samples
    exposure  what a PNG multiplies radiance by before it is encoded
    Raises InvalidValueError for a scene that cannot be rendered; its `field` is the place.
    """

    camera: Camera
    objects: tuple[Shape, ...]
    lights: tuple[Light, ...]
    samples: int = 64
    noise: float | None = None
    exposure: float = 1.0

    def __post_init__(self) -> None:
        if not isinstance(self.camera, Camera):
            raise InvalidValueError(
                f"Expected camera to be a Camera, got {self.camera!r}. Make it by its class.", field="camera"
            )
        for name, kind in (("objects", Shape), ("lights", Light)):
            parts = getattr(self, name)
            if not isinstance(parts, list | tuple) or not all(isinstance(part, kind) for part in parts):
                raise InvalidValueError(
                    f"Expected {name} to be a sequence of {kind.__name__}s, got {parts!r}. Make each by its class.",
                    field=name,
                )
            object.__setattr__(self, name, tuple(parts))
            if not parts:
                raise InvalidValueError(
                    f"Expected {name} to hold at least one {name[:-1]}, got none. Add one.", field=name
                )
        _checks.whole("samples", self.samples, 1, 2**24)
        _checks.positive("exposure", self.exposure)
        if self.noise is not None:
            _checks.positive("noise", self.noise)
        for index, shape in enumerate(self.objects):
            if shape.contains(self.camera.position):
                raise InvalidValueError(
                    f"Expected camera.position to be outside of objects[{index}], got {list(self.camera.position)}, "
                    "which is inside or below. Move the camera.",
                    field="camera.position",
                )
            if shape.material.channels not in (1, 3):
                raise InvalidValueError(
                    f"Expected objects[{index}].material to have 1 or 3 channels, got {shape.material.channels}. "
                    "Images are gray or red, green and blue.",
                    field=f"objects[{index}].material",
                )
        zero = torch.zeros((), dtype=torch.float64)
        if all(float(light.colour(zero).detach().max()) == 0 for light in self.lights):
            raise InvalidValueError(
                "Expected one of the lights to shine, got strengths of 0. Give one a strength.", field="lights"
            )

    @property
    def channels(self) -> int:
        """The channels that are computed: 1 where nothing has colour, else 3."""
        counts = [light.colour(torch.zeros(())).numel() for light in self.lights]
        return max([shape.material.channels for shape in self.objects] + counts)

    def to_json(self) -> dict[str, Any]:
        """The scene as JSON-able data, exact."""
        return {
            "camera": {name: _json.plain(value) for name, value in vars(self.camera).items()},
            "objects": [_json.part(shape, SHAPES) for shape in self.objects],
            "lights": [_json.part(light, LIGHTS) for light in self.lights],
            **{name: getattr(self, name) for name in ("samples", "noise", "exposure")},
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any], folder: str | Path | None = None) -> "Scene":
        """The scene of such data; one sentence with the place where it is none.

        Measured files are read from `folder`; without one, data that come from elsewhere open no file here.
        """
        given = _json.fields(cls, data, "")
        materials: dict[str, Material | Tabulated] = {}
        camera = _json.made(Camera, _json.fields(Camera, given.pop("camera"), "camera"), "camera")
        parts: dict[str, list[Any]] = {}
        place = None if folder is None else Path(folder)
        for name, kinds in (("objects", SHAPES), ("lights", LIGHTS)):
            entries = given.pop(name)
            if not isinstance(entries, list):
                raise InvalidValueError(f"Expected {name} to be a list, got {entries!r}. Write one.", field=name)
            parts[name] = [
                _json.of_kind(entry, kinds, f"{name}[{index}]", materials, place) for index, entry in enumerate(entries)
            ]
        return cls(camera=camera, **parts, **given)  # type: ignore[arg-type]

    @classmethod
    def load(cls, path: str | Path) -> "Scene":
        """The scene of a JSON file, or of a shipped one by its name (`SCENES`)."""
        file = Path(path)
        if not file.suffix and not file.exists():
            if str(path) not in SCENES:
                raise unknown_name("a scene", str(path), SCENES, field="scene")
            file = SCENES[str(path)]
        try:
            data = json.loads(file.read_text(encoding="utf-8"))
        except OSError as error:
            raise FormatError(
                f"Expected scene to be a readable file, got {file.name!r} ({error.strerror}). Check the path.",
                field="scene",
            ) from error
        except (ValueError, RecursionError) as error:
            raise InvalidValueError(
                f"Expected {file.name} to be JSON, got: {error}. Correct it there.", field="scene"
            ) from None
        return cls.from_json(data, file.parent)


SCENES: dict[str, Path] = {file.stem: file for file in sorted(SHIPPED.glob("*.json"))}
