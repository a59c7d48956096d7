"""`bc.next_directions`: where to measure next, so that the fit's values become surest for the instrument's time.

    cov = A^-1 B A^-1,    A = sum j j^T,    B = sum v j j^T,    chosen to make det cov least (D-optimal)

j is the exact derivative of a residual by the free values at the optimum, v the variance of that residual: what the
fit to old and new samples will have, under its loss, whether or not that weighs as the noise would. Known sigma makes
v; else the residuals do, as noise that is even and noise that grows with the value (signal_noise.py), and both are
carried to the new directions. Values are taken one by one, then exchanged one by one as long as that gains. A value
that the data leave free is known to lie in its box and no better, so that the first directions are those that
determine it. Under a loss that does not weigh as the noise would, a noisy sample can make some value less sure than it
was, however much it tells of others: directions that would are passed over, as long as there are others.

What is proposed lies on a grid that a goniometer reaches: polar angles to `max_theta`, in the plane of incidence, and
out of it where the data are; the sample is turned where the data's was. Values on an end of their box count as if
they could leave it: that more data would move them is what the present data cannot exclude.
Source: Fedorov 1972, exchange of design points; White 1980 for A^-1 B A^-1.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import torch
from torch import Tensor

from ..errors import ParameterError
from ..formats.samples import Samples, angles
from ..geometry import from_angles
from .criterion import spread
from .data import Data
from .given import plain, whole
from .limits import check_angle
from .losses import LOSSES
from .problem import Problem
from .result import Fit
from .robust import ROBUST
from .signal_noise import noise

_STEP = 5.0  # degrees between polar angles
_EXACT, _UNTOLD = 1e-6, 1e-3  # the least noise, as shares of f, where residuals tell of it and where they do not
_NEAR = (-8.0, -6.0, -4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0)  # degrees from the mirror direction
_TURN = 30.0  # degrees between azimuths
_ROUNDS = 4  # of exchanges; one or two find all there is
_TRIED = 512  # of the best candidates, among which one that makes no value less sure is looked for
_AT_ONCE = 64  # of those
_WORK = 2e8  # candidates times the cube of the values: the grid is thinned beyond


@dataclass(frozen=True)
class NextDirections:
    """Directions to measure next, the most useful first, and what they are expected to do.

    wi, wo            (K, 3) unit vectors that leave the surface
    shrinkage         key -> () or (C,): the width of the value's interval after, as a share of that before [1]; of a
                      value that the data left undetermined, as a share of its box
    information       by how much the logarithm of 1/det cov rises [1]
    """

    wi: Tensor
    wo: Tensor
    shrinkage: dict[str, Tensor]
    information: float

    @property
    def angles(self) -> dict[str, Tensor]:
        """theta_i, phi_i, theta_o, phi_o, each (K,) [rad]."""
        (theta_i, phi_i), (theta_o, phi_o) = angles(self.wi), angles(self.wo)
        return {"theta_i": theta_i, "phi_i": phi_i, "theta_o": theta_o, "phi_o": phi_o}

    def to_dict(self) -> dict[str, Any]:
        """The directions as JSON-able data, angles in degrees."""
        return {
            "directions": [
                dict(zip((f"{name}_deg" for name in self.angles), row, strict=True))
                for row in torch.rad2deg(torch.stack(list(self.angles.values()), -1)).tolist()
            ],
            "shrinkage": {key: value.tolist() for key, value in self.shrinkage.items()},
            "information": self.information,
        }

    def __str__(self) -> str:
        """The directions and the shrinkage as plain text, angles in degrees, a line each."""
        rows = torch.rad2deg(torch.stack(list(self.angles.values()), -1)).tolist()
        lines = [f"{'measure next [deg]':<20}" + "".join(f"{name:>10}" for name in self.angles)]
        lines += [f"{number:<20}" + "".join(f"{angle:>10.4g}" for angle in row) for number, row in enumerate(rows, 1)]
        lines.append("intervals then, as shares of those now:")
        for key, value in self.shrinkage.items():
            lines.append(f"{key:<32}" + ", ".join(f"{share:.3g}" for share in value.reshape(-1).tolist()))
        return "\n".join(lines)


def next_directions(fit: Fit, count: int, max_theta: float = math.radians(85)) -> NextDirections:
    """So many directions, no two alike, whose samples would make the fit's values surest.

    max_theta    [rad] the steepest polar angle that the instrument reaches, of light and of viewer

    Raises ParameterError for a count below 1, an angle out of range, or a fit without a free value.
    """
    if not isinstance(fit, Fit):
        raise ParameterError(
            f"Expected fit to be a Fit, got {type(fit).__name__}. Pass what bc.fit returned.", field="fit"
        )
    wanted, max_theta = check_count(count), plain(max_theta)
    check_angle(max_theta)
    plan = replace(fit.plan, start=fit.values, starts=())
    scale = None if fit.robust_scale is None else torch.tensor([fit.robust_scale], dtype=torch.float64)
    problem = Problem(plan, fit.samples, LOSSES[fit.loss], robust_scale=scale)
    x = problem.pack(fit.values).unsqueeze(0)
    if not problem.size:
        raise ParameterError(
            "Expected fit to have a free value, got one whose every value is fixed. Free one, then fit.", field="fit"
        )
    design = _Design(problem, x, fit)
    wi, wo = reachable(fit.samples, max_theta)
    thin = max(1, math.ceil(len(wi) * problem.size**3 / _WORK))
    wi, wo = wi[::thin], wo[::thin]
    columns, variance = design.candidates(wi, wo)
    chosen = _exchanged(design, columns, variance, min(wanted, len(wi)))
    before = design.covariance(design.a, design.b)
    after = design.covariance(*design.joined(columns[chosen], variance[chosen]))
    ratio = (after.diagonal() / before.diagonal()).sqrt()
    shrinkage = {key: ratio[at].reshape(plan.start[key].shape) for key, at in problem.slices.items()}
    information = float(torch.logdet(before) - torch.logdet(after))
    return NextDirections(wi[chosen], wo[chosen], shrinkage, information)


def check_count(count: object) -> int:
    """The number of directions; raises ParameterError where this is none."""
    wanted = whole(count)
    if wanted is None or wanted < 1:
        raise ParameterError(f"Expected count to be a whole number from 1 on, got {count!r}. Use 10.", field="count")
    return wanted


def reachable(samples: Samples, max_theta: float) -> tuple[Tensor, Tensor]:
    """The pairs wi, wo (G, 3) that an instrument reaches which could measure the samples."""
    across = torch.linalg.cross(samples.wi, samples.wo)[:, 2].abs()  # the sines' product, with that between azimuths
    aside = samples.azimuth_observed or bool((across > math.sin(math.radians(1))).any())
    theta, phi = angles(samples.wi)
    first = math.degrees(float(phi[theta.argmax()]))
    turns = torch.arange(0, 180, _TURN) if samples.azimuth_observed else torch.tensor([first])
    sides = torch.arange(0, 360, _TURN) if aside else torch.tensor([0.0, 180.0])
    limit = math.degrees(max_theta)
    tilts = torch.tensor([*torch.arange(0, limit, _STEP).tolist(), limit])
    grid = torch.cartesian_prod(tilts, turns, tilts, sides)
    near = torch.cartesian_prod(tilts, turns, torch.tensor(_NEAR))
    mirror = torch.stack([near[:, 0], near[:, 1], near[:, 0] + near[:, 2], torch.full((len(near),), 180.0)], -1)
    mirror = mirror[(mirror[:, 2] > 0) & (mirror[:, 2] <= limit)]
    t_i, p_i, t_o, side = torch.cat([grid, mirror]).double().deg2rad().T
    wi, wo = from_angles(t_i, p_i), from_angles(t_o, p_i + side)
    pairs = torch.cat([wi, wo], -1)
    keys = torch.unique((pairs * 1e6).round() + 0.0, dim=0, return_inverse=True)[1]
    _, order = keys.sort(stable=True)
    firsts = order[torch.cat([torch.ones(1, dtype=torch.bool), keys[order].diff() > 0])].sort().values
    return wi[firsts], wo[firsts]


class _Design:
    """What the samples so far tell of the values that are free to move, and what more would."""

    def __init__(self, problem: Problem, x: Tensor, fit: Fit) -> None:
        self.problem, self.x, self.fit = problem, x, fit
        samples, data = fit.samples, problem.data
        f = torch.cat([problem.f(x, piece) for piece in data.chunks(problem.channels)], -1)  # (1, C, N)
        self.least = 1e-300
        if samples.sigma is not None:
            self.noise = noise(samples.sigma.T.square().reshape(-1), f.reshape(-1))
            known = samples.sigma.T.square().unsqueeze(0)
        else:
            left = (1 - spread(problem, x).leverage).clamp(min=1e-3)
            squares, values, at = [], [], 0
            for piece in data.chunks(problem.channels):  # as the leverages stand
                own = f[..., at : at + len(piece.c)]
                counted = (piece.root_weight > 0).expand_as(own)
                squares.append(_counted(problem, own, piece)[counted].square())
                values.append(own[counted])
                at += len(piece.c)
            self.noise = noise(torch.cat(squares) / left, torch.cat(values))
            # residuals of an exact fit are rounding; those of as many samples as values say nothing of the noise
            size = float(f.square().mean().sqrt()) or 1.0
            told = sum(map(len, values)) > problem.size
            self.least = ((_EXACT if told else _UNTOLD) * size) ** 2
            known = self.noise.variance(f).clamp(min=self.least)
        size = problem.size
        a, b = torch.zeros(size, size, dtype=torch.float64), torch.zeros(size, size, dtype=torch.float64)
        total, at = 0.0, 0
        for piece in data.chunks(problem.channels):
            _, columns, slope = problem.jacobian(x, piece)
            v = slope.square() * known[..., at : at + len(piece.c)]
            at += len(piece.c)
            a += problem.scatter_matrix(columns @ columns.mT)[0]
            b += problem.scatter_matrix((columns * v.unsqueeze(2)) @ columns.mT)[0]
            total += float(v.sum())
        typical = total / max(1, at * problem.channels) or 1.0
        ranges = (problem.high - problem.low).clamp(min=1e-9)
        known_from_box = torch.diag(typical / ranges.square())
        self.a, self.b = a + known_from_box, b + typical * known_from_box

    def candidates(self, wi: Tensor, wo: Tensor) -> tuple[Tensor, Tensor]:
        """The derivatives (G, C, P) of the residuals at new directions, and their variances (G, C)."""
        problem, samples = self.problem, self.fit.samples
        with torch.no_grad():
            f = self.fit.material.f(wi, wo).expand(-1, problem.channels)
        variance = self.noise.variance(f).clamp(min=self.least)
        weight, cell = (None if w is None else w[w > 0].mean().expand(len(wi)) for w in (samples.weight, samples.cell))
        sigma = None if samples.sigma is None else variance.sqrt()
        new = Samples(wi, wo, f, samples.channels, sigma, weight=weight, cell=cell)
        data = Data.of([new], problem.plan.form.needs, problem.loss_kind, problem.data.scales)
        parts = [problem.jacobian(self.x, piece) for piece in data.chunks(problem.channels)]
        columns = torch.cat([columns[0] for _, columns, _ in parts], -1).permute(2, 0, 1)
        slope = torch.cat([slope[0] for _, _, slope in parts], -1).T
        return columns, slope.square() * variance

    def with_(self, columns: Tensor, variance: Tensor) -> tuple[Tensor, Tensor]:
        """What each of some candidates adds to A and B, (K, D, D)."""
        each = columns.unsqueeze(-1) * columns.unsqueeze(-2)  # (K, C, P, P)
        a = self.problem.scatter_matrix(each)
        b = self.problem.scatter_matrix(each * variance[..., None, None])
        return a, b

    def joined(self, columns: Tensor, variance: Tensor) -> tuple[Tensor, Tensor]:
        """A and B of the samples so far and of some candidates together, (D, D)."""
        a, b = self.with_(columns, variance)
        return self.a + a.sum(0), self.b + b.sum(0)

    def covariance(self, a: Tensor, b: Tensor) -> Tensor:
        """A^-1 B A^-1."""
        inverse = torch.linalg.inv(a)
        found: Tensor = inverse @ b @ inverse
        return found

    def information(self, a: Tensor, b: Tensor, columns: Tensor, variance: Tensor) -> Tensor:
        """Each log 1/det cov with one candidate added to A and B, (G,)."""
        found = []
        step = max(1, 2_000_000 // (columns.shape[1] * columns.shape[2] ** 2 + len(a) ** 2))
        for some, v in zip(columns.split(step), variance.split(step), strict=True):
            more_a, more_b = self.with_(some, v)
            found.append(2 * torch.linalg.slogdet(a + more_a)[1] - torch.linalg.slogdet(b + more_b)[1])
        return torch.cat(found)


def _counted(problem: Problem, f: Tensor, data: Data) -> Tensor:
    """What is left of the values beside f (1, C, N), as much as a robust form counts of it."""
    left = f - data.y
    if problem.plan.robust is None or problem.robust_scale is None:
        return left
    plain = Problem(replace(problem.plan, robust=None), [], problem.loss_kind, data=data)
    z = (plain.residuals(f, data, None)[1] / (problem.robust_scale * data.counted)).square()
    return left * ROBUST[problem.plan.robust].functions(z)[1]


def _exchanged(design: _Design, columns: Tensor, variance: Tensor, count: int) -> list[int]:
    """The candidates that make the values surest: one by one, then each exchanged for a better one if there is one."""
    chosen: list[int] = []
    before = design.covariance(design.a, design.b).diagonal().clamp(min=1e-300)

    def best(rest: list[int]) -> tuple[int, float]:
        a, b = design.joined(columns[rest], variance[rest])
        score = design.information(a, b, columns, variance)
        score[rest] = -torch.inf
        score = score.nan_to_num(nan=-torch.inf)
        order = score.argsort(descending=True, stable=True)[: min(_TRIED, len(score) - len(rest))]
        growths = []
        for some in order.split(_AT_ONCE):
            more_a, more_b = design.with_(columns[some], variance[some])
            after = design.covariance(a + more_a, b + more_b).diagonal(dim1=-2, dim2=-1)
            growths.append((after / before).amax(-1).nan_to_num(nan=torch.inf))
            surer = growths[-1] <= 1 + 1e-9
            if bool(surer.any()):
                at = int(some[int(surer.int().argmax())])
                return at, float(score[at])
        at = int(order[int(torch.cat(growths).argmin())])
        return at, float(score[at])

    reached = -math.inf
    for _ in range(count):
        at, reached = best(chosen)
        chosen.append(at)
    for _ in range(_ROUNDS):
        gained = False
        for i in range(count):
            at, score = best(chosen[:i] + chosen[i + 1 :])
            if score > reached + 1e-9:
                chosen[i], reached, gained = at, score, True
        if not gained:
            break
    return chosen
