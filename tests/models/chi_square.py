"""A chi-square test of samples of directions against a density: cells over the hemisphere, and one for what is lost.

The cells' edges are quantiles of a pilot sample, so narrow and grazing lobes fill them evenly; the masses expected in
them are integrals of the density, refined until their error is far below the noise of the counts.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from albedo_quadrature import panels
from scipy import stats

Function = Callable[[torch.Tensor], torch.Tensor]
NODES = 8
RELATIVE = 3e-4  # of a cell's mass: adds 0.1 to the statistic at a million samples
# Quantiles of the pilot that bound the cells. The outermost keep the lobe's edge apart from the empty rest; in them the
# quadrature's nodes crowd towards the lobe, which it would otherwise miss. What they hold is pooled where it is sparse.
LEVELS = (0.0, 0.001, 0.01, 0.05, *(k / 10 for k in range(1, 10)), 0.95, 0.99, 0.999, 1.0)


@dataclass(frozen=True)
class Cells:
    """Bands in the polar angle, each cut into sectors of azimuth."""

    theta: np.ndarray  # (bands + 1,) from 0 to pi/2
    phi: np.ndarray  # (bands, sectors + 1), each from a start to a full turn later

    @property
    def count(self) -> int:
        return self.phi.shape[0] * (self.phi.shape[1] - 1)

    def index(self, wi: torch.Tensor) -> np.ndarray:
        """The number of the cell that holds each direction above the horizon; `count` for one that is not."""
        w = wi.detach().double().numpy()
        theta = np.arctan2(np.hypot(w[:, 0], w[:, 1]), w[:, 2])
        band = np.clip(np.searchsorted(self.theta, theta, side="right") - 1, 0, len(self.phi) - 1)
        start = self.phi[band, 0]
        phi = start + np.mod(np.arctan2(w[:, 1], w[:, 0]) - start, 2 * math.pi)
        sector = np.clip((phi[:, None] >= self.phi[band]).sum(-1) - 1, 0, self.phi.shape[1] - 2)
        return np.where(w[:, 2] > 0, band * (self.phi.shape[1] - 1) + sector, self.count)

    def integrate(self, function: Function, tolerance: float) -> np.ndarray:
        """The integral of function(wi) dwi over each cell, to the absolute or RELATIVE error, or it fails."""
        bands, sectors = self.phi.shape[0], self.phi.shape[1] - 1
        low_t, high_t = np.repeat(self.theta[:-1], sectors), np.repeat(self.theta[1:], sectors)
        low_p, high_p = self.phi[:, :-1].ravel(), self.phi[:, 1:].ravel()
        band, sector = np.divmod(np.arange(self.count), sectors)
        side_t, side_p = (band == bands - 1) * 1 - (band == 0), (sector == sectors - 1) * 1 - (sector == 0)
        pending = np.arange(self.count)
        result = np.full(self.count, np.nan)
        for pieces in (1, 2, 4, 8, 16, 32, 64, 128, 256):
            steps = np.linspace(0, 1, pieces + 1)
            value = np.empty(len(pending))
            chunk = max(1, 2**18 // (pieces * NODES) ** 2)
            for at in range(0, len(pending), chunk):
                k = pending[at : at + chunk]
                t, dt = _graded(steps, low_t[k], high_t[k], side_t[k])
                p, dp = _graded(steps, low_p[k], high_p[k], side_p[k])
                t, dt, p, dp = t[:, :, None], dt[:, :, None], p[:, None, :], dp[:, None, :]
                wi = np.stack(np.broadcast_arrays(np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)), -1)
                with torch.no_grad():
                    density = function(torch.tensor(wi).reshape(-1, 3)).numpy().reshape(wi.shape[:-1])
                value[at : at + chunk] = (density * np.sin(t) * dt * dp).sum((1, 2))
            settled = np.abs(value - result[pending]) <= np.maximum(tolerance, RELATIVE * np.abs(value))
            result[pending] = value
            pending = pending[~settled]
            if not len(pending):
                return result
        raise AssertionError(f"{len(pending)} cells' integrals did not settle")


def _graded(steps: np.ndarray, low: np.ndarray, high: np.ndarray, side: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights (n, m) on each interval, crowded to its low end where side > 0, high where < 0, else both."""
    s, ds = panels(steps, NODES)
    side, span, low = side[:, None], (high - low)[:, None], low[:, None]
    middle, middle_slope = s**3 * (10 - s * (15 - 6 * s)), 30 * (s * (1 - s)) ** 2
    part = np.where(side > 0, s**6, np.where(side < 0, 1 - (1 - s) ** 6, middle))
    slope = np.where(side > 0, 6 * s**5, np.where(side < 0, 6 * (1 - s) ** 5, middle_slope))
    return low + span * part, span * slope * ds


def cells_of(pilot: torch.Tensor, levels: tuple[float, ...] = LEVELS) -> Cells:
    """Cells that a sample like the pilot fills about evenly."""
    w = pilot[pilot[:, 2] > 0].detach().double().numpy()
    theta = np.arctan2(np.hypot(w[:, 0], w[:, 1]), w[:, 2])
    phi = np.arctan2(w[:, 1], w[:, 0])
    bands = len(levels) - 1
    edges = np.quantile(theta, levels)
    edges[0], edges[-1] = 0.0, math.pi / 2
    band = np.clip(np.searchsorted(edges, theta, side="right") - 1, 0, bands - 1)
    phi_edges = np.empty((bands, bands + 1))
    for b in range(bands):
        inside = phi[band == b] if (band == b).any() else phi
        start = math.atan2(-np.sin(inside).mean(), -np.cos(inside).mean())  # opposite to where they are
        turned = np.mod(inside - start, 2 * math.pi)
        phi_edges[b] = start + np.quantile(turned, levels)
        phi_edges[b, 0], phi_edges[b, -1] = start, start + 2 * math.pi
    return Cells(edges, phi_edges)


def p_value(wi: torch.Tensor, pdf: Function, cells: Cells) -> float:
    """The probability of counts at least as odd as these if wi were drawn from pdf; 0 for what is no sub-density."""
    count = len(wi)
    noise = math.sqrt(1 / (count * cells.count))  # of an evenly filled cell's share, times about 1/cells
    mass = cells.integrate(pdf, 0.02 * noise / math.sqrt(cells.count))
    lost = 1 - mass.sum()
    if lost < -4 * noise or (mass < -noise).any():
        return 0.0
    expected = count * np.append(np.maximum(mass, 0), max(lost, 0.0))
    observed = np.bincount(cells.index(wi), minlength=cells.count + 1).astype(float)
    sparse = expected < 10  # pooled, so that the statistic is near its limiting distribution
    if sparse.any():
        pooled_expected, pooled_observed = expected[sparse].sum(), observed[sparse].sum()
        expected, observed = expected[~sparse], observed[~sparse]
        if pooled_expected >= 1:
            expected, observed = np.append(expected, pooled_expected), np.append(observed, pooled_observed)
        elif pooled_observed > 20:
            return 0.0
    statistic = ((observed - expected) ** 2 / expected).sum()
    return float(stats.chi2.sf(statistic, len(expected) - 1))


def sidak(level: float, tests: int) -> float:
    """The level of each of so many tests that together err with probability `level`."""
    return 1 - (1 - level) ** (1 / tests)
