"""Samples from what a reader found in a file; rows at the horizon or without a value are masked, with the reason."""

import math
from collections.abc import Mapping
from typing import Unpack

import numpy as np
import numpy.typing as npt
import torch

from ..errors import FormatError, SamplesError
from ._checks import default_where
from .samples import Masked, Samples, SamplesKeywords, direction

Array = npt.NDArray[np.float64]

HORIZON = 1e-9  # |cos theta| below which a direction is at the horizon, where no BRDF can be measured
ROUNDED = 5e-6  # pi/2 in a file of radians with four or more decimals exceeds pi/2 by at most this [rad]


def from_columns(columns: Mapping[str, Array], values: Array, **keywords: Unpack[SamplesKeywords]) -> Samples:
    """Samples from theta_i, phi_i, theta_o, phi_o [rad], each (N,), or from wi, wo (N, 3), and values (N, C).

    A NaN among the values stands for an empty cell; the reader has refused every other one. `where` names the file's
    row in errors. Raises FormatError where nothing is left, SamplesError for a bad row.
    """
    where = keywords.get("where", default_where)
    directions: dict[str, torch.Tensor] = {}
    elevations: dict[str, Array] = {}  # above the horizon: an angle [rad] or the sine of it
    for side in ("i", "o"):
        if f"w{side}" in columns:
            directions[f"w{side}"] = torch.from_numpy(columns[f"w{side}"])
            elevations[f"w{side}"] = columns[f"w{side}"][:, 2]
        else:
            theta, phi = columns[f"theta_{side}"], columns[f"phi_{side}"]
            directions[f"w{side}"] = direction(torch.from_numpy(theta), torch.from_numpy(phi))
            elevations[f"theta_{side}"] = math.pi / 2 - np.abs(theta)
    for name, elevation in elevations.items():
        below = elevation < -ROUNDED
        if below.any():
            row = int(below.argmax())
            is_angle = name.startswith("theta")
            rule = "at most 90 degrees from the normal" if is_angle else "above the horizon (z > 0)"
            got = f"{90 - math.degrees(elevation[row]):.9g} degrees" if is_angle else f"z = {elevation[row]:.9g}"
            advice = (
                "Remove the row, or declare the right angle_unit." if is_angle else "Remove the row or turn it round."
            )
            raise SamplesError(f"Expected {name} to be {rule}, got {got} at {where(row)}. {advice}", field=name)
    horizon = np.any([elevation < HORIZON for elevation in elevations.values()], axis=0)
    empty = np.isnan(values).any(-1) & ~horizon
    kept = np.flatnonzero(~(horizon | empty))
    masked = (
        Masked("a direction is at the horizon, where no BRDF can be measured", int(horizon.sum())),
        Masked("a value's cell is empty", int(empty.sum())),
    )
    if len(kept) == 0:
        reasons = "; ".join(f"{m.count} rows where {m.reason}" for m in masked if m.count)
        raise FormatError(
            f"Expected the file to hold at least one usable sample, got only {reasons}. Check its columns."
        )
    everything = len(kept) == len(values)
    for name in ("sigma", "weight", "cell"):
        column = keywords.get(name)
        if column is not None and not everything:
            keywords[name] = column[kept]  # type: ignore[literal-required, index]
    keywords["masked"] = (*keywords.get("masked", ()), *(m for m in masked if m.count))
    keywords["where"] = lambda row: where(int(kept[row]))
    rows = slice(None) if everything else torch.from_numpy(kept)
    return Samples(directions["wi"][rows], directions["wo"][rows], values[kept], **keywords)
