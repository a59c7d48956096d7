"""The effects that `model="auto"` chooses among, and the text of the material that has them.

    [lambert +] [ggx(isotropic | anisotropic, constant | schlick) [+ the same again]]

Every material with more effects contains those with fewer, at a corner of its box or as two values that are equal:
f0 = 1 is `constant`, ax = ay is `isotropic`, ks = 0 is no lobe. So what an effect adds is that effect and nothing else.
That is why the lobe is one that has a Fresnel factor to switch on: beside `ward_bounded` a lobe with one is another
model, whose gain could be that of another shadowing. `kurt`'s alpha and f0 both act on grazing angles, and take each
other's place; `ggx` has shadowing without a value to fit, reflects at most what comes in, and has long tails without
a second lobe.

Once the effects are found, the same ones are tried with lobes of another shape (FAMILIES): Beckmann's, whose tails are
short, and Ward's with bounded albedo, which has neither shadowing nor Fresnel; one stays if it foretells better.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

AUTO = "auto"
STEPS = ("lobe", "Fresnel", "anisotropy", "second lobe")  # the order in which they are tried
PARTS = ("diffuse", *STEPS[1:])  # what may turn out not to be called for once the rest is there
FAMILIES = ("ggx", "beckmann", "ward_bounded")  # the first is climbed with, the others take its place at the end
_WITHOUT_FRESNEL = ("ward_bounded",)


@dataclass(frozen=True)
class Effects:
    """Which effects a material has."""

    diffuse: bool = True
    lobes: int = 0
    fresnel: bool = False
    anisotropic: bool = False
    family: str = FAMILIES[0]

    def text(self) -> str:
        """The material's text, every option named."""
        words = f"{'an' if self.anisotropic else ''}isotropic"
        if self.family not in _WITHOUT_FRESNEL:
            words += f", {'schlick' if self.fresnel else 'constant'}"
        return " + ".join(["lambert"] * self.diffuse + [f"{self.family}({words})"] * self.lobes)

    def of(self, family: str) -> "Effects | None":
        """The same effects of another family; None where it has not all of them."""
        return None if self.fresnel and family in _WITHOUT_FRESNEL else replace(self, family=family)

    def near(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Values by key of leaner or richer effects, as a start for these: an isotropic lobe is one of equal widths."""
        widths = {f"{key}{axis}": a for key, a in values.items() if key.endswith(".a") for axis in "xy"}
        return {**values, **widths}

    def plus(self, effect: str) -> "Effects | None":
        """These and one more; None where it is there, or has no lobe to act on."""
        if effect == "lobe":
            return replace(self, lobes=1) if self.lobes == 0 else None
        if self.lobes == 0:
            return None
        richer = {
            "Fresnel": replace(self, fresnel=True),
            "anisotropy": replace(self, anisotropic=True),
            "second lobe": replace(self, lobes=2),
        }[effect]
        if richer.fresnel and self.family in _WITHOUT_FRESNEL:
            return None
        return None if richer == self else richer

    def minus(self, effect: str) -> "Effects | None":
        """These without one; None where it is not there, or nothing would be left."""
        if self.lobes == 0:
            return None
        leaner = {
            "diffuse": replace(self, diffuse=False),
            "Fresnel": replace(self, fresnel=False),
            "anisotropy": replace(self, anisotropic=False),
            "second lobe": replace(self, lobes=1),
        }[effect]
        return None if leaner == self else leaner


RICHEST = tuple(
    Effects(lobes=2, fresnel=family not in _WITHOUT_FRESNEL, anisotropic=turned, family=family)
    for family in reversed(FAMILIES)
    for turned in (False, True)
)
