"""The directional albedo of a measured grid, by its own samples.

    a(wo) = mean of f cos theta_i / pdf over scrambled Sobol points                                        [1]

The claimed error is four standard errors of eight scramblings, which double their points until it is small enough, or
until there are 2^15 in all: a table is not smooth, so 1e-3 is what most of them get to.
"""

import math
import time

import torch
from torch import Tensor

from ..geometry import from_angles
from ..tabulated import Tabulated

SCRAMBLINGS = 8
FEWEST, MOST = 2**8, 2**12  # points a scrambling
ERRORS = 4.0  # standard errors that are claimed


def of_table(table: Tabulated, theta: Tensor, phi: Tensor, tolerance: float) -> tuple[Tensor, Tensor, int, float]:
    """Values (..., C) and claimed errors (..., C) [1], evaluations, and seconds, for theta and phi (...) [rad]."""
    start = time.perf_counter()
    theta, phi = torch.broadcast_tensors(theta, phi)
    rows, evaluations = [], 0
    for one, azimuth in zip(theta.reshape(-1), phi.reshape(-1), strict=True):
        wo = from_angles(one, azimuth)
        engines = [torch.quasirandom.SobolEngine(3, scramble=True, seed=seed) for seed in range(SCRAMBLINGS)]
        sums, drawn, count = torch.zeros(SCRAMBLINGS, table.channels, dtype=torch.float64), 0, FEWEST
        while True:
            u = torch.stack([engine.draw(count, dtype=torch.float64) for engine in engines])
            wi = table.sample(wo, u)
            sums += table.weight(wi, wo.expand_as(wi)).sum(1)
            drawn += count
            means = sums / drawn
            error = ERRORS * means.std(0) / math.sqrt(SCRAMBLINGS)
            if bool((error <= tolerance * means.mean(0).clamp(min=1)).all()) or drawn >= MOST:
                break
            count = drawn
        evaluations += SCRAMBLINGS * drawn
        rows.append((means.mean(0), error))
    values, errors = (torch.stack(part).reshape(*theta.shape, -1) for part in zip(*rows, strict=True))
    return values, errors, evaluations, time.perf_counter() - start
