"""What each effect of a rich material is worth: it is left out, without fitting the rest again.

The material holds a diffuse term under a Fresnel factor, an anisotropic microfacet lobe with exact dielectric Fresnel
reflection and height-correlated shadowing, a second, wide lobe, and three channels. What is left out is replaced by
the nearest simpler thing: a colour by its mean, two widths by their geometric mean, a Fresnel factor by its value at
normal incidence. The error is the root mean square of f without / f with - 1 over directions and channels: half of
them uniform over the hemisphere, half drawn by the material, so that a lobe counts where its light is.
"""

import math
import statistics
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from ..geometry import from_angles
from ..models.material import Material, material
from ..plots._panels import Curve, Panel
from ._study import Cell, Chart, Study
from ._timing import interleaved

_COLOURS = {"diffuse": (0.30, 0.12, 0.06), "lobe": (0.9, 0.8, 0.7), "second": (0.12, 0.1, 0.08)}
_ETA, _AX, _AY, _WIDE = 1.5, 0.08, 0.25, 0.5
_F0 = ((_ETA - 1) / (_ETA + 1)) ** 2
EFFECTS = {
    "colour": "one channel, the mean of the three",
    "anisotropy": "one width, the geometric mean of the two",
    "exact Fresnel": "Schlick's approximation of the lobe's Fresnel factor",
    "Fresnel": "the lobe's and the coupling's reflectance at normal incidence, for all angles",
    "coupling": "Lambert's term with the same reflectance at normal incidence",
    "height correlation": "shadowing and masking as if they were independent",
    "second lobe": "no wide lobe",
    "lobes": "no lobe at all",
}


@dataclass(frozen=True)
class _Simpler:
    """The material without some effects."""

    without: frozenset[str]

    def has(self, effect: str) -> bool:
        return effect not in self.without

    def made(self) -> Material:
        """The material."""
        terms = [self._diffuse()]
        if self.has("lobes"):
            terms.append(self._lobe())
            if self.has("second lobe"):
                terms.append(self._second())
        return material(" + ".join(terms))

    def _colour(self, name: str, factor: float = 1.0) -> str:
        values = [factor * value for value in _COLOURS[name]]
        return str(values) if self.has("colour") else str(statistics.fmean(values))

    def _diffuse(self) -> str:
        if self.has("coupling") and self.has("Fresnel"):
            return f"coupled_lambert(kd={self._colour('diffuse')}, f0={_F0})"
        return f"lambert(kd={self._colour('diffuse', 1 - _F0)})"

    def _lobe(self) -> str:
        widths = f"ax={_AX}, ay={_AY}" if self.has("anisotropy") else f"a={math.sqrt(_AX * _AY)}"
        shadowing = "correlated" if self.has("height correlation") else "separable"
        if not self.has("Fresnel"):
            fresnel = f"constant, ks={self._colour('lobe', _F0)}"
        elif not self.has("exact Fresnel"):
            fresnel = f"schlick, ks={self._colour('lobe')}, f0={_F0}"
        else:
            fresnel = f"dielectric, ks={self._colour('lobe')}, eta={_ETA}"
        return f"ggx({shadowing}, {fresnel}, {widths})"

    def _second(self) -> str:
        return f"ward_bounded(isotropic, rs={self._colour('second')}, a={_WIDE})"


def effects(quick: bool = False, seed: int = 0, *, count: int | None = None, repeats: int | None = None) -> Study:
    """The study over `count` directions."""
    count = count or (2**14 if quick else 2**17)
    whole = _Simpler(frozenset()).made()
    wi, wo = _directions(whole, count, seed)
    alone = {effect: _Simpler(frozenset({effect})) for effect in EFFECTS}
    errors = {effect: _error(simpler.made(), whole, wi, wo) for effect, simpler in alone.items()}
    order = sorted(errors, key=lambda effect: errors[effect])
    together = [_Simpler(frozenset(order[: n + 1])) for n in range(len(order))]
    materials = {(): whole} | {tuple(sorted(s.without)): s.made() for s in [*alone.values(), *together]}
    tasks = {str(key): _task(m, wi, wo) for key, m in materials.items()}
    rounds = max(1, (repeats or (16 if quick else 24)) // 2)
    first, second = (interleaved(tasks, rounds) for _ in range(2))
    least = _told_from_none(first, second)
    time = {key: 1e9 * min(first[str(key)], second[str(key)]) / count for key in materials}
    base = time[()]
    rows: list[tuple[Cell, ...]] = [("nothing", "", 0.0, base, 0.0)]
    for effect in order:
        each = time[(effect,)]
        rows.append((effect, EFFECTS[effect], errors[effect], each, 1 - each / base))
    spent = tuple(time[tuple(sorted(s.without))] for s in together)
    made = tuple(_error(s.made(), whole, wi, wo) for s in together)
    for number, (each, error) in enumerate(zip(spent, made, strict=True), 1):
        rows.append((f"the first {number} of these", "", error, each, 1 - each / base))
    curves = [Curve(effect, (time[(effect,)],), (errors[effect],)) for effect in order]
    line = Curve("one after another", spent, made)
    return Study(
        name="effects",
        question="what error each effect of a material makes where it is left out, and what time that saves",
        columns=("left out", "instead", "RMS relative error [1]", "time [ns]", "time saved [1]"),
        rows=tuple(rows),
        charts=(
            Chart(
                "effects",
                "Leaving effects out: error of f against the time a direction",
                (Panel(f"with everything: {base:.3g} ns", (line, *curves)),),
                "time a direction [ns]",
                "RMS relative error of f [1]",
            ),
        ),
        sentence=_sentence(errors, {effect: 1 - time[(effect,)] / base for effect in order}, least),
        notes=(
            f"The material: {whole}.",
            f"{count} pairs of directions in float64; times are the lower of two medians of interleaved evaluations "
            f"of f, which differ by so much that savings below {100 * least:.2g} % count as none.",
        ),
    )


_NORMAL = 1.4826  # standard deviations in the median distance from the median, of a normal distribution


def _told_from_none(first: dict[str, float], second: dict[str, float]) -> float:
    """The share of time saved that two runs of the same tasks can tell from none: two standard errors of their mean.

    By the median of what differs, since a busy moment of the machine is no error of all tasks.
    """
    apart = [(a - b) / (a + b) for a, b in zip(first.values(), second.values(), strict=True)]
    middle = statistics.median(apart)  # what slows all tasks of a run alike changes no saving
    return 2 * math.sqrt(2) * _NORMAL * statistics.median(abs(x - middle) for x in apart)


def _directions(whole: Material, count: int, seed: int) -> tuple[Tensor, Tensor]:
    """Directions wi, wo (count, 3) above the horizon: half uniform over it, half drawn by the material."""
    generator = torch.Generator().manual_seed(seed)
    u = torch.rand(2 * count, 7, dtype=torch.float64, generator=generator)
    wo, even = (from_angles(torch.acos(u[:, k]), 2 * torch.pi * u[:, k + 1]) for k in (0, 2))
    with torch.no_grad():
        drawn = whole.sample(wo, u[:, 4:])
    drawn_above = drawn[:, 2] > 0
    half = count // 2
    wi = torch.cat([drawn[drawn_above][:half], even[: count - half]])
    return wi, torch.cat([wo[drawn_above][:half], wo[: count - half]])


def _error(simpler: Material, whole: Material, wi: Tensor, wo: Tensor) -> float:
    """The root mean square of f of one over f of the other, less 1."""
    with torch.no_grad():
        return float((simpler.f(wi, wo) / whole.f(wi, wo) - 1).square().mean().sqrt())


def _task(made: Material, wi: Tensor, wo: Tensor) -> Callable[[], object]:
    def run() -> Tensor:
        with torch.no_grad():
            return made.f(wi, wo)

    return run


def _sentence(errors: dict[str, float], saved: dict[str, float], least: float) -> str:
    """What to leave out first, and what to keep; savings up to `least` are the clock's noise."""
    worth = {effect: share for effect, share in saved.items() if share > least}
    dearest = max(errors, key=lambda effect: errors[effect])
    keep = f"keep {dearest}, which changes f by {100 * errors[dearest]:.2g} %"
    if not worth:
        return f"Leave nothing out for speed, since no effect alone costs more than the clock's noise, and {keep}."
    best = min(worth, key=lambda effect: errors[effect] / worth[effect])
    sentence = (
        f"Leave out {best} first: it saves {100 * worth[best]:.2g} % of the time for an error of "
        f"{100 * errors[best]:.2g} %; {keep}"
    )
    free = [effect for effect in errors if effect not in worth and effect != dearest]
    if not free:
        return f"{sentence}."
    many = len(free) > 1
    costs = (
        f"; {_listed(free)} {'cost' if many else 'costs'} no time that shows, so keep {'them' if many else 'it'} too"
    )
    return f"{sentence}{costs}."


def _listed(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
