"""A scene: shapes with materials, lights and a camera, and its JSON.

    {"camera": {"position": [3, 0, 1], "look_at": [0, 0, 0], "fov_deg": 30, "width": 64, "height": 64},
     "objects": [{"kind": "sphere", "center": [0, 0, 0], "radius": 1, "material": "lambert(kd=0.5)"}],
     "lights": [{"kind": "dome", "radiance": 1}]}

Lengths are in one unit of the user's choice, radiance in another; angles are in degrees, as their names say. A material
is a text, a preset's name, or what Material.to_json returned. Objects with the same material's text share one material.
"""

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from ..errors import BrdfError, InvalidValueError, unknown_name
from ..models.material import Material, material
from . import _checks
from ._checks import Vector
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
LARGEST = 16384  # pixels along an edge
SHIPPED = Path(__file__).parent / "scenes"


@dataclass(frozen=True, kw_only=True)
class Camera:
    """A pinhole at `position` that looks at `look_at`; `fov_deg` is the vertical angle of the image [degrees].

    A pixel is the mean of grid x grid rays in a fixed raster; 1 sends one ray through its centre.
    """

    position: Vector
    look_at: Vector
    width: int
    height: int
    fov_deg: float = 30.0
    up: Vector = (0.0, 0.0, 1.0)
    grid: int = 1

    def __post_init__(self) -> None:
        for name in ("position", "look_at"):
            object.__setattr__(self, name, _checks.vector(name, getattr(self, name)))
        object.__setattr__(self, "up", _checks.direction("up", self.up))
        for name in ("width", "height"):
            _checks.whole(name, getattr(self, name), 1, LARGEST)
        _checks.whole("grid", self.grid, 1, 16)
        if not 0 < _checks.positive("fov_deg", self.fov_deg) < 180:
            raise InvalidValueError(
                f"Expected fov_deg to be above 0 and below 180, got {self.fov_deg:g}. Narrow it.", field="fov_deg"
            )
        forward = torch.tensor(self.look_at, dtype=torch.float64) - torch.tensor(self.position, dtype=torch.float64)
        side = torch.linalg.cross(forward, torch.tensor(self.up, dtype=torch.float64))
        if float(side.norm()) <= 1e-9 * float(forward.norm()):
            raise InvalidValueError(
                f"Expected look_at to differ from position, and not along up, got {list(self.look_at)}. "
                "Move it, or turn up.",
                field="look_at",
            )

    def rays(self, device: torch.device | str = "cpu") -> Tensor:
        """The unit directions of all rays, (height, width, grid^2, 3), in double precision."""
        place = torch.zeros((), dtype=torch.float64, device=device)
        forward = torch.nn.functional.normalize(place.new_tensor(self.look_at) - place.new_tensor(self.position), dim=0)
        right = torch.nn.functional.normalize(torch.linalg.cross(forward, place.new_tensor(self.up)), dim=0)
        above = torch.linalg.cross(right, forward)
        n, half = self.grid, math.tan(math.radians(self.fov_deg) / 2)
        columns, rows = (torch.arange(count * n, device=device).to(place) + 0.5 for count in (self.width, self.height))
        x = (columns / n - self.width / 2) * (2 * half / self.height)
        y = (self.height / 2 - rows / n) * (2 * half / self.height)
        rays = forward + x[None, :, None] * right + y[:, None, None] * above
        rays = rays.reshape(self.height, n, self.width, n, 3).transpose(1, 2).reshape(self.height, self.width, n * n, 3)
        return torch.nn.functional.normalize(rays, dim=-1)


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
        if all(float(light.colour(torch.zeros(())).detach().max()) == 0 for light in self.lights):
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
            "camera": {name: _plain(value) for name, value in vars(self.camera).items()},
            "objects": [_part(shape, SHAPES) for shape in self.objects],
            "lights": [_part(light, LIGHTS) for light in self.lights],
            **{name: getattr(self, name) for name in ("samples", "noise", "exposure")},
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> "Scene":
        """The scene of such data; one sentence with the place where it is none."""
        fields = _fields(cls, data, "")
        materials: dict[str, Material] = {}
        camera = _made(Camera, _fields(Camera, fields.pop("camera"), "camera"), "camera")
        parts: dict[str, list[Any]] = {}
        for name, kinds in (("objects", SHAPES), ("lights", LIGHTS)):
            entries = fields.pop(name)
            if not isinstance(entries, list):
                raise InvalidValueError(f"Expected {name} to be a list, got {entries!r}. Write one.", field=name)
            parts[name] = [_of_kind(entry, kinds, f"{name}[{index}]", materials) for index, entry in enumerate(entries)]
        return cls(camera=camera, **parts, **fields)  # type: ignore[arg-type]

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
        except ValueError as error:
            raise InvalidValueError(
                f"Expected {file.name} to be JSON, got: {error}. Correct it there.", field="scene"
            ) from None
        return cls.from_json(data)


SCENES: dict[str, Path] = {file.stem: file for file in sorted(SHIPPED.glob("*.json"))}


def _fields(kind: type, data: object, where: str) -> dict[str, Any]:
    """The fields of a dataclass in JSON data, with unknown and missing ones told."""
    what = where or "the scene"
    if not isinstance(data, Mapping):
        raise InvalidValueError(
            f"Expected {what} to be an object, got {data!r}. Write {{...}}.", field=where or "scene"
        )
    declared = {field.name: field for field in dataclasses.fields(kind)}
    prefix = f"{where}." if where else ""
    for name in data:
        if name not in declared:
            raise unknown_name(f"a field of {what}", str(name), declared, field=f"{prefix}{name}")
    for name, field in declared.items():
        if field.default is dataclasses.MISSING and name not in data:
            raise InvalidValueError(
                f"Expected {prefix}{name} to be given, got nothing. Add it to {what}.", field=f"{prefix}{name}"
            )
    return dict(data)


def _of_kind(entry: object, kinds: Mapping[str, type], where: str, materials: dict[str, Material]) -> Any:
    """The shape or light of an entry."""
    if not isinstance(entry, Mapping) or not isinstance(entry.get("kind"), str):
        raise InvalidValueError(
            f"Expected {where}.kind to be one of {', '.join(kinds)}, got {entry!r}. Name the kind.",
            field=f"{where}.kind",
        )
    if entry["kind"] not in kinds:
        raise unknown_name(f"{where}.kind", entry["kind"], kinds, field=f"{where}.kind")
    kind = kinds[entry["kind"]]
    fields = _fields(kind, {name: value for name, value in entry.items() if name != "kind"}, where)
    if "material" in fields:
        key = json.dumps(fields["material"], sort_keys=True)
        if key not in materials:
            try:
                given = fields["material"]
                materials[key] = material(given) if isinstance(given, str) else Material.from_json(given)
            except BrdfError as error:
                raise type(error)(f"{where}.material: {error.message}", field=f"{where}.material") from None
        fields["material"] = materials[key]
    return _made(kind, fields, where)


def _made(kind: type, fields: Mapping[str, Any], where: str) -> Any:
    """An instance, or its error with the place."""
    try:
        return kind(**fields)
    except BrdfError as error:
        raise _checks.located(error, where) from None


def _part(part: Shape | Light, kinds: Mapping[str, type]) -> dict[str, Any]:
    """A shape or light as JSON-able data."""
    kind = next(name for name, made in kinds.items() if type(part) is made)
    return {"kind": kind, **{name: _plain(value) for name, value in vars(part).items() if value not in (None, "")}}


def _plain(value: object) -> Any:
    if isinstance(value, Material):
        return value.to_json()
    if isinstance(value, Tensor) or (isinstance(value, Sequence) and not isinstance(value, str)):
        return _checks.as_json(value)
    return value
