"""What a plan says: each effect, on or off, why, what it costs, and what leaving it out changes at most."""

import math
from dataclasses import dataclass, replace
from typing import Any

from .measured import AnySurface
from .scene import Scene

CLOSED_FORM = "closed form"
LOOK_UP = "albedo look-up"
SHADOWS = "shadow rays"
LIGHT_SAMPLING = "light sampling"
BRDF_SAMPLING = "brdf sampling"
WEIGHTS = "sample weights"
INTERREFLECTION = "interreflection"  # with the bounce's number after it


@dataclass(frozen=True)
class Effect:
    """A row of the plan."""

    name: str
    on: bool
    reason: str
    cost: float  # term evaluations and ray tests that it adds, or would add, to the image
    error: float  # bound on what leaving it out changes in a pixel [radiance]; inf where nothing bounds it
    forced: bool = False
    partial: bool = False  # whether `error` is a part of the bound only, of an effect that it keeps on
    estimated: bool = False  # whether `error` is no bound: that of a mean radiance, or of a table's sampled albedo

    @property
    def bounce(self) -> bool:
        """Whether it is an interreflection."""
        return self.name.startswith(INTERREFLECTION) and ": " not in self.name


@dataclass(frozen=True, eq=False)
class Plan:
    """What is simulated, for `render`."""

    scene: Scene
    tolerance: float  # [radiance]
    effects: tuple[Effect, ...]
    surfaces: tuple[AnySurface, ...]  # one a material
    surface_of: tuple[int, ...]  # of each object
    depth: int  # interreflections
    albedo_tolerance: float

    def on(self, name: str) -> bool:
        """Whether an effect is simulated; False for one that the scene does not have."""
        return any(effect.on for effect in self.effects if effect.name == name)

    def __getitem__(self, name: str) -> Effect:
        """The row of an effect."""
        return next(effect for effect in self.effects if effect.name == name)

    @property
    def error(self) -> float:
        """The sum of the bounds of what is left out [radiance]; interreflections count from the first left out."""
        off = [effect for effect in self.effects if not effect.on]
        bounces = [effect.error for effect in off if effect.bounce]
        return sum(effect.error for effect in off if not effect.bounce) + max(bounces, default=0.0)

    @property
    def met(self) -> bool:
        """Whether that is within the tolerance."""
        return self.error <= self.tolerance

    @property
    def cost(self) -> float:
        """Term evaluations and ray tests of the image, predicted."""
        return sum(effect.cost for effect in self.effects if effect.on)

    def to_dict(self) -> dict[str, Any]:
        """The table as JSON-able data; None where nothing bounds an error."""
        return {
            "effects": [{**vars(effect), "error": _finite(effect.error)} for effect in self.effects],
            "tolerance": self.tolerance,
            "error": _finite(self.error),
            "met": self.met,
            "cost": self.cost,
        }

    def _told(self) -> list[Effect]:
        """The rows of the table: interreflections that are on are one."""
        on = [effect for effect in self.effects if effect.on and effect.bounce]
        if len(on) < 2:
            return list(self.effects)
        name = f"{on[0].name} to {on[-1].name.removeprefix(INTERREFLECTION).strip()}"
        together = replace(on[0], name=name, cost=sum(effect.cost for effect in on))
        return [together if effect is on[0] else effect for effect in self.effects if effect not in on[1:]]

    def __str__(self) -> str:
        """The table."""
        rows = [("effect", "", "cost", "error without", "reason")]
        for effect in self._told():
            error = "unbounded" if math.isinf(effect.error) else f"{effect.error:.1e}" if effect.error else "0"
            error = ("> " if effect.partial else "~ " if effect.estimated and effect.error else "") + error
            word = ("on" if effect.on else "off") + (" (forced)" if effect.forced else "")
            rows.append((effect.name, word, f"{effect.cost:.1e}", error, effect.reason))
        sizes = [max(len(row[k]) for row in rows) for k in range(4)]
        lines = ["  ".join([*(cell.ljust(n) for cell, n in zip(row[:4], sizes, strict=True)), row[4]]) for row in rows]
        met = "within" if self.met else "NOT within"
        word = "about" if any(e.estimated and e.error and not e.on for e in self.effects) else "at most"
        bound = "unbounded" if math.isinf(self.error) else f"{self.error:.1e}"
        return "\n".join([*lines, f"left out: {word} {bound}, {met} the tolerance {self.tolerance:g}"])


def _finite(x: float) -> float | None:
    return x if math.isfinite(x) else None
