"""What measured samples are: what was measured where, how it lies about the mirror direction, and what it can show.

`info(samples)` gives an `Info`: facts for a program (`to_dict`), the same as text for people (`text`). Angles are in
degrees, values in 1/sr.
"""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from ._reflectance import Reflectance, incidences, reflectances
from .samples import Samples, angles

MOST_FOR_PAIRS = 100_000  # samples of an instrument; a larger table has neighbours at every tenth of a degree
NEAR_MIRROR = 5.0  # degrees from the mirror direction
_STEP = 10.0  # directions are the same to a tenth of a degree
_SHOWN = 12  # incidences and channels that the text lists


@dataclass(frozen=True)
class ChannelRange:
    """The values of one channel [1/sr]."""

    channel: str
    least: float
    median: float
    largest: float


@dataclass(frozen=True)
class Reciprocity:
    """Pairs of samples in which light and viewer change places, and their relative difference |f - g| / mean(f, g)."""

    pairs: int
    median: float
    largest: float


@dataclass(frozen=True)
class Info:
    """What samples are; `report` is what `Samples.report` says of them."""

    report: dict[str, Any]
    ranges: tuple[ChannelRange, ...]
    azimuth_declared: bool  # whether file or format says it; else it follows from the azimuths of wi
    incidences_deg: tuple[tuple[float, int], ...]  # each theta_i and its count of samples, to a tenth of a degree
    theta_h_deg: tuple[float, float]  # of the half vector from the normal, least and largest
    theta_d_deg: tuple[float, float]  # of the directions from the half vector
    near_mirror: int  # samples within NEAR_MIRROR of the mirror direction
    brightest_from_mirror_deg: float
    reciprocity: Reciprocity | None  # None where there are no such pairs, or more than MOST_FOR_PAIRS samples
    reflectance: tuple[Reflectance, ...]  # where enough directions were measured around one incidence

    def to_dict(self) -> dict[str, Any]:
        """All of it, ready for JSON."""
        facts = asdict(self)
        return {**facts.pop("report"), **facts}

    def text(self) -> str:
        """All of it as lines for people, the name of the fact first."""
        return "\n".join(f"{name:<22}{line}" for name, line in self._lines())

    def _lines(self) -> list[tuple[str, str]]:
        facts = self.report
        lines = [
            ("file", facts["source"] or "none"),
            ("format", facts["format"] or "none"),
            ("quantity", f"{facts['quantity']}, kept as the BRDF [1/sr]"),
            ("samples", f"{facts['samples']:,} in {len(self.ranges)} channel{'s' * (len(self.ranges) > 1)}"),
        ]
        extras = [name for name in ("sigma", "weight") if facts[f"has_{name}"]]
        lines += [("with", " and ".join(extras))] if extras else []
        for side, what in (("i", "light"), ("o", "viewer")):
            theta, phi = (facts[f"{angle}_{side}_deg"] for angle in ("theta", "phi"))
            lines.append((what, f"theta_{side} {_span(theta)}, phi_{side} {_span(phi)} degrees"))
        listed = ", ".join(f"{theta:g} ({count})" for theta, count in self.incidences_deg[:_SHOWN])
        count = len(self.incidences_deg)
        if count <= _SHOWN:
            lines.append(("incidences", f"theta_i (samples): {listed}"))
        else:
            lines.append(("incidences", f"{count:,} values of theta_i"))
        lines.append(("half vector", f"theta_h {_span(self.theta_h_deg)}, theta_d {_span(self.theta_d_deg)} degrees"))
        lines.append(
            (
                "mirror direction",
                f"{self.near_mirror:,} samples within {NEAR_MIRROR:g} degrees; "
                f"the brightest is {self.brightest_from_mirror_deg:.1f} degrees away",
            )
        )
        observed = "observed" if facts["azimuth_observed"] else "not observed"
        why = "as the file or its format says" if self.azimuth_declared else "by the azimuths of the light"
        lines.append(("sample's azimuth", f"{observed}, {why}"))
        for number, values in enumerate(self.ranges[:_SHOWN]):
            line = f"{values.channel}: {values.least:.4g} to {values.largest:.4g}, median {values.median:.4g}"
            lines.append(("values [1/sr]" if number == 0 else "", line))
        if len(self.ranges) > _SHOWN:
            lines.append(("", f"and so on to {self.ranges[-1].channel}"))
        lines.append(("negative, zero", f"{facts['negative_values']:,} and {facts['zero_values']:,} values, kept"))
        masked = [f"{m['count']:,} left out: {m['reason']}" for m in facts["masked"]] or ["nothing was left out"]
        lines += [("masked" if number == 0 else "", line) for number, line in enumerate(masked)]
        if self.reciprocity is None:
            few = facts["samples"] <= MOST_FOR_PAIRS
            none = "no pairs in which light and viewer change places" if few else "not looked for in so many samples"
            lines.append(("reciprocity", none))
        else:
            found = self.reciprocity
            lines.append(
                (
                    "reciprocity",
                    f"{found.pairs:,} pairs differ by {100 * found.median:.2g} % (median), "
                    f"{100 * found.largest:.2g} % at most",
                )
            )
        for number, row in enumerate(self.reflectance):
            azimuth = f", phi_i {row.phi_i_deg:g}" if facts["azimuth_observed"] else ""
            least, most = (round(value, 3) + 0.0 for value in (min(row.values), max(row.values)))  # + 0.0: no -0.000
            error = max(row.error)
            span = f"{least:.3f}" if len(row.values) == 1 else f"{least:.3f} to {most:.3f}"
            line = f"theta_i {row.theta_i_deg:g}{azimuth}: {span}, estimated error {error:.1g}"
            lines.append(("reflectance" if number == 0 else "", line))
        if not self.reflectance:
            lines.append(("reflectance", "unknown: too few directions around one incidence for lobes like these"))
        return lines


def info(samples: Samples) -> Info:
    """What the samples are, where they lie, and what they can show; for a million samples it takes seconds."""
    theta_h, theta_d = half_angles_deg(samples)
    mirror = samples.wi * samples.wi.new_tensor([-1.0, -1.0, 1.0])
    off = torch.rad2deg(2 * torch.asin(((mirror - samples.wo).norm(dim=-1) / 2).clamp(max=1)))  # exact near 0
    distinct, index = incidences(samples)
    theta, place = distinct[:, 0].unique(return_inverse=True)
    counts = torch.zeros(len(theta), dtype=torch.int64).scatter_add_(0, place, index.bincount(minlength=len(distinct)))
    return Info(
        report=samples.report(),
        ranges=tuple(
            ChannelRange(channel, float(values.min()), float(values.median()), float(values.max()))
            for channel, values in zip(samples.channels, samples.values.unbind(1), strict=True)
        ),
        azimuth_declared=samples.azimuth_declared is not None,
        incidences_deg=tuple((float(t) / _STEP, int(n)) for t, n in zip(theta, counts, strict=True)),
        theta_h_deg=(float(theta_h.min()), float(theta_h.max())),
        theta_d_deg=(float(theta_d.min()), float(theta_d.max())),
        near_mirror=int((off <= NEAR_MIRROR).sum()),
        brightest_from_mirror_deg=float(off[samples.values.mean(-1).argmax()]),
        reciprocity=_reciprocity(samples),
        reflectance=reflectances(samples),
    )


def half_angles_deg(samples: Samples) -> tuple[Tensor, Tensor]:
    """Angles of the half vector from the normal and of the directions from the half vector [degrees], each (N,)."""
    half = torch.nn.functional.normalize(samples.wi + samples.wo, dim=-1)
    theta_d = torch.asin(((samples.wi - samples.wo).norm(dim=-1) / 2).clamp(max=1))  # half the angle between them
    return torch.rad2deg(angles(half)[0]), torch.rad2deg(theta_d)


def _reciprocity(samples: Samples) -> Reciprocity | None:
    """How far values differ where light and viewer change places, to a tenth of a degree; means over channels.

    Where the sample's azimuth was not observed, only the difference of azimuth counts, and not its sign.
    """
    if len(samples) > MOST_FOR_PAIRS:
        return None
    (theta_i, phi_i), (theta_o, phi_o) = angles(samples.wi), angles(samples.wo)
    if samples.azimuth_observed:
        columns = (theta_i, phi_i, theta_o, phi_o), (theta_o, phi_o, theta_i, phi_i)
    else:
        turn = torch.remainder(phi_i - phi_o, 2 * math.pi)
        turn = torch.minimum(turn, 2 * math.pi - turn)
        columns = (theta_i, turn, theta_o, 0 * turn), (theta_o, turn, theta_i, 0 * turn)
    here, there = (_keys(given) for given in columns)
    order = np.argsort(here, kind="stable")
    at = np.searchsorted(here[order], there).clip(max=len(here) - 1)
    other = order[at]
    rows = np.flatnonzero((here[other] == there) & (here < there))  # each pair once, and none with itself
    if len(rows) == 0:
        return None
    f = samples.values.mean(-1).numpy()
    first, second = f[rows], f[other[rows]]
    scale = (np.abs(first) + np.abs(second)) / 2
    difference = np.abs(first - second) / np.where(scale > 0, scale, 1.0)
    return Reciprocity(len(rows), float(np.median(difference)), float(difference.max()))


def _keys(columns: tuple[Tensor, ...]) -> "np.ndarray[tuple[int], np.dtype[np.int64]]":
    """One number a row for four angles [rad], each to a tenth of a degree."""
    key = np.zeros(len(columns[0]), dtype=np.int64)
    for angle in columns:
        tenths = torch.round(torch.rad2deg(angle) * _STEP).to(torch.int64).numpy() % 3600
        key = key * 3600 + tenths
    return key


def _span(ends: "tuple[float, float] | list[float]") -> str:
    """A range of angles [degrees]."""
    low, high = (f"{round(end, 3) + 0.0:.4g}" for end in ends)  # + 0.0 for the sign of a zero
    return low if low == high else f"{low} to {high}"
