"""The directional-hemispherical reflectance of measured samples, where enough directions were measured around one wi.

    R(wi) = integral of f cos theta_o dwo = pi times the mean of f over the unit disc of (x, y) of wo     [1]

The mean is over nodes of equal area, each with the value of the nearest measured direction. Where the sample's azimuth
was not observed, both sides of the plane of incidence count as measured. The error is twice the largest change when
every second direction, or every second pair of them, is left out; few directions in a narrow lobe make it as large as
the lobe's share. What lies farther than 0.15 (9 degrees at the normal) from every measured direction, or is steeper
than all of them, counts in full. Nothing is said of an incidence where the former is more than a twentieth of the disc,
or the error more than half the value.
It is an estimate: for Lambert's and other lobes on a goniometer's grid it holds up to theta_i = 60 deg, and to a factor
of 2 at 75 deg, where more of a lobe lies beyond the steepest direction (tests/formats/test_info.py).
"""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from .samples import Samples, angles

NODES = 4000
REACH = 0.15  # of a measured direction, as a distance on the unit disc
UNREACHED = 0.05  # share of the disc beyond it, at which nothing is said any more
VAGUE = 0.5  # error as a share of the value, over all channels
FEWEST = 30  # directions around one incidence
MOST_INCIDENCES = 50  # a file with more has samples everywhere, and few around each
_STEP = 10.0  # incidences are told apart to a tenth of a degree


@dataclass(frozen=True)
class Reflectance:
    """The directional-hemispherical reflectance at one incidence: a value and an error a channel [1]."""

    theta_i_deg: float
    phi_i_deg: float
    directions: int
    values: tuple[float, ...]
    error: tuple[float, ...]


def incidences(samples: Samples) -> tuple[Tensor, Tensor]:
    """The distinct incidences (theta_i, phi_i) in tenths of a degree, (G, 2), and each sample's index among them.

    The azimuth counts where the sample was turned, and not at the normal.
    """
    theta, phi = (torch.round(torch.rad2deg(angle) * _STEP) for angle in angles(samples.wi))
    azimuth = torch.remainder(phi, 360 * _STEP) if samples.azimuth_observed else torch.zeros_like(phi)
    turn = 360 * _STEP
    keys = theta * turn + torch.where(theta == 0, torch.zeros_like(theta), azimuth)  # one number sorts faster than two
    distinct, index = keys.unique(return_inverse=True)
    return torch.stack([distinct.div(turn, rounding_mode="floor"), distinct.remainder(turn)], -1), index


def reflectances(samples: Samples) -> tuple[Reflectance, ...]:
    """The reflectance at every incidence around which enough directions were measured, in rising order of theta_i."""
    distinct, index = incidences(samples)
    if len(distinct) > MOST_INCIDENCES:
        return ()
    nodes = _nodes()
    found = []
    for number, (theta, phi) in enumerate(distinct.tolist()):
        one = samples.subset(index == number)
        if len(one) < FEWEST:
            continue
        across = one.wi[:, :2]
        along = torch.nn.functional.normalize(across, dim=-1)
        along = torch.where(across.norm(dim=-1, keepdim=True) > 1e-6, along, along.new_tensor([1.0, 0.0]))
        x = (one.wo[:, :2] * along).sum(-1)
        y = along[:, 0] * one.wo[:, 1] - along[:, 1] * one.wo[:, 0]
        measured, values = torch.stack([x, y], -1), one.values
        if not samples.azimuth_observed:
            measured, values = torch.cat([measured, measured * measured.new_tensor([1.0, -1.0])]), values.repeat(2, 1)
        distance, nearest = torch.cdist(nodes, measured).min(1)
        beyond = distance > REACH
        if beyond.double().mean() > UNREACHED:
            continue
        mean = math.pi * values[nearest].mean(0)
        order = torch.arange(len(values)) % len(one)  # a direction and its mirror image go together
        halves = [order // pair % 2 == half for pair in (1, 2) for half in (0, 1)]
        changes = [
            (math.pi * values[half][torch.cdist(nodes, measured[half]).argmin(1)].mean(0) - mean).abs()
            for half in halves
        ]
        rim = nodes.norm(dim=-1) > measured.norm(dim=-1).max()  # steeper than every measured direction
        unmeasured = math.pi * (values[nearest].abs() * (beyond | rim)[:, None]).mean(0)
        error = 2 * torch.stack(changes).amax(0) + unmeasured
        if error.sum() > VAGUE * mean.sum():
            continue
        found.append(Reflectance(theta / _STEP, phi / _STEP, len(one), tuple(mean.tolist()), tuple(error.tolist())))
    return tuple(found)


def _nodes() -> Tensor:
    """Points of equal area on the unit disc, (NODES, 2), on Vogel's spiral."""
    k = torch.arange(NODES, dtype=torch.float64) + 0.5
    radius, turn = torch.sqrt(k / NODES), k * math.pi * (3 - math.sqrt(5))
    return torch.stack([radius * turn.cos(), radius * turn.sin()], -1)
