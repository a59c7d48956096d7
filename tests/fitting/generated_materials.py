"""Random materials whose every effect shows in their data, for tests of which effects a fit finds."""

import math
from dataclasses import dataclass

import numpy as np
import torch

import brdfcore as bc
from brdfcore.fitting.effects import Effects

NOISE = 0.02  # of each value


@dataclass(frozen=True)
class Generated:
    effects: Effects
    text: str
    samples: bc.Samples


def geometry(*, turned: bool) -> bc.Samples:
    """What a goniometer sees: in the plane of incidence and out of it, denser about the mirror direction."""
    rows = []
    turns = (0.0, 30.0, 60.0, 90.0) if turned else (0.0,)
    tilts = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0) if turned else tuple(np.linspace(0, 78, 14))
    offsets = (-3, -1.5, 0, 1.5, 3, 6, -6, 10, -10, 16, -16, 25, -25, 40, -40, 60, -60, 85, -100, -120)
    for theta_i in tilts:
        for turn in turns:
            for offset in offsets:
                theta_o = theta_i + offset
                if abs(theta_o) < 83:
                    rows.append((theta_i, turn, theta_o, turn + 180))
            for side in (5, 12, 25, 50, 90, 150):
                rows += [(theta_i, turn, theta_o, turn + 180 + side) for theta_o in (12, 35, 60)]
    angles = np.array(rows)
    return bc.Samples.from_angles(*angles.T, values=np.zeros(len(rows)), unit="degrees")


def random_effects(random: np.random.Generator, *, turned: bool) -> Effects:
    lobes = int(random.choice([0, 1, 2], p=[0.12, 0.48, 0.4]))
    if not lobes:
        return Effects()
    return Effects(
        diffuse=bool(random.random() < 0.8),
        lobes=lobes,
        fresnel=bool(random.random() < 0.5),
        anisotropic=turned and bool(random.random() < 0.5),
    )


def random_text(effects: Effects, random: np.random.Generator, channels: int) -> str:
    def colour(low: float, high: float) -> str:
        found = np.exp(random.uniform(math.log(low), math.log(high), channels)).round(6).tolist()
        return str(found[0] if channels == 1 else found)

    parts = [f"lambert(kd={colour(0.02, 0.6)})"] * effects.diffuse
    for _ in range(effects.lobes):
        width = math.exp(random.uniform(math.log(0.05), math.log(0.6)))
        ratio = math.exp(random.uniform(math.log(1.2), math.log(4)) / 2)
        ends = (width * ratio, width / ratio) if random.random() < 0.5 else (width / ratio, width * ratio)
        shape = "ax={:.6g}, ay={:.6g}".format(*ends) if effects.anisotropic else f"a={width:.6g}"
        f0 = f", f0={random.uniform(0.02, 0.7):.6g}" if effects.fresnel else ""
        parts.append(f"ggx(ks={colour(0.03, 0.9)}{f0}, {shape}{'' if effects.fresnel else ', constant'})")
    return " + ".join(parts)


def of(text: str, where: bc.Samples) -> torch.Tensor:
    with torch.no_grad():
        return bc.material(text).f(where.wi, where.wo)


def shows(effects: Effects, f: torch.Tensor, where: bc.Samples) -> bool:
    """Whether leaving out any effect raises the noiseless error above the noise."""
    noise = float((NOISE * where.wi[:, 2:] * f).square().mean().sqrt())
    names = ["diffuse", "Fresnel", "anisotropy", "second lobe"]
    leaner = [effects.minus(name) for name in names] + ([Effects()] if effects.lobes else [])
    clean = bc.Samples(where.wi, where.wo, f)
    return all(bc.fit(clean, one.text()).errors["cosine_rms"] > noise for one in leaner if one is not None)


def generated(seed: int) -> Generated:
    """The material of a seed: drawn again until each of its effects shows."""
    random = np.random.default_rng(seed)
    turned = seed % 2 == 0
    channels = 3 if seed % 4 == 1 else 1
    where = geometry(turned=turned)
    effects = random_effects(random, turned=turned)
    while True:
        text = random_text(effects, random, channels)
        f = of(text, where)
        if shows(effects, f, where):
            break
    noisy = f * (1 + NOISE * torch.from_numpy(random.standard_normal(f.shape)))
    return Generated(effects, text, bc.Samples(where.wi, where.wo, noisy))


def parts(effects: Effects) -> dict[str, bool]:
    return {
        "diffuse": effects.diffuse,
        "lobe": effects.lobes > 0,
        "Fresnel": effects.fresnel,
        "anisotropy": effects.anisotropic,
        "second lobe": effects.lobes == 2,
    }


def chosen(fit: bc.Fit) -> dict[str, bool]:
    """The effects of the material that a fit chose."""
    labels = [term.label for term in fit.form.terms]
    words = {word for term in fit.form.terms for word in term.model.options}
    return {
        "diffuse": "lambert" in labels,
        "lobe": "ggx" in labels,
        "Fresnel": "schlick" in words,
        "anisotropy": "anisotropic" in words,
        "second lobe": "ggx_2" in labels,
    }
