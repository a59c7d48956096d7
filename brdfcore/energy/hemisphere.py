"""Integrals of any lobe: adaptive cells in the unit square of the term's own samples.

    a = integral of f cos theta_i / pdf du over the square,  wi = sample(wo, u),  u = v^3 (10 - 15 v + 6 v^2)   [1]

What the samples follow is level in u, and what a sampler has of roots and logarithms at the square's edges is smooth in
v, so cells need to be small only at the horizon and at kinks. A cell's integral by a Gauss-Legendre product is compared
with the sum over its quarters, which is kept. A cell counts as wrong by `SAFETY` times the largest of that difference,
`INHERITED` of what counted before it was divided, since two sums may be alike by chance, and, where it lies across the
horizon, but none of its nodes as low as wo, so that the step or layer there has not been met, `UNSEEN` of what it adds.
The error claimed is the sum over all cells. Half-vector lobes, and all that have a formula, are integrated faster by
their own rules.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from ..geometry import geometry
from ..models import Model
from ..parameters import Values
from .refinement import LEAST_WEIGHT, Refined, Rows, take
from .rules import gauss

ORDER = 8  # nodes along a side of a cell
FIRST = 4  # cells along a side of the square
MOST = 2**18  # nodes a row
CELLS = 2**8  # cells at a time
ROUNDING = 1e-15
CORNERS = ((0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0))
BELOW_1 = 1 - 2.0**-53
SAFETY, INHERITED, UNSEEN = 4.0, 0.03, 0.1  # fitted to true errors of random cases (tests/energy/test_albedo_peers.py)


@dataclass(eq=False)
class Cells:
    """Squares of the unit square: the row each belongs to, its lower corner and its side."""

    row: Tensor  # (N,)
    corner: Tensor  # (N, 2)
    side: Tensor  # (N,)

    def __getitem__(self, which: Tensor) -> "Cells":
        return Cells(self.row[which], self.corner[which], self.side[which])

    def quarters(self) -> "Cells":
        """The four quarters of each."""
        half = self.side.repeat_interleave(4) / 2
        steps = torch.tensor([[0, 0], [0, 1], [1, 0], [1, 1]], dtype=half.dtype, device=half.device)
        corner = self.corner.repeat_interleave(4, dim=0) + half[:, None] * steps.repeat(len(self.side), 1)
        return Cells(self.row.repeat_interleave(4), corner, half)

    def joined(self, other: "Cells") -> "Cells":
        """These and the other ones."""
        return Cells(*(torch.cat(pair) for pair in zip(vars(self).values(), vars(other).values(), strict=True)))


class Hemisphere:
    """The bases of a model, integrated for some directions wo over cells made for some values; none is neglected."""

    def __init__(self, model: Model, place: Values, rows: Rows, error: float) -> None:
        self.model, self.rows = model, rows
        self.place = {name: value.detach() for name, value in place.items()}
        self.leaves: Cells

    def integrals(self, own: Values, cells: Cells) -> tuple[Tensor, Tensor, Tensor]:
        """The bases' integrals over each cell (N, K, 1 or C), the same for absolute values, and what none has met."""
        parts = [
            self._of(own, cells[some]) for some in torch.arange(len(cells.side), device=cells.row.device).split(CELLS)
        ]
        value, absolute, unseen = (torch.cat(part) for part in zip(*parts, strict=True))
        return value, absolute, unseen

    def _of(self, own: Values, cells: Cells) -> tuple[Tensor, Tensor, Tensor]:
        rule = gauss(ORDER).to(cells.row.device)
        s, t = torch.meshgrid(rule.nodes, rule.nodes, indexing="ij")
        co, toward = (v[:, None] for v in self.rows.take(cells.row))
        with torch.no_grad():
            places = torch.cat([torch.stack([s, t], -1).reshape(-1, 2), s.new_tensor(CORNERS)])
            v = cells.corner[:, None] + cells.side[:, None, None] * places
            u = (v.pow(3) * (10 + v * (6 * v - 15))).clamp(max=BELOW_1)
            v = v[:, : ORDER**2]
            slope = (30 * (v * (1 - v)).square()).prod(-1, keepdim=True) * cells.side.square()[:, None, None]
            weights = (rule.weights[:, None] * rule.weights).reshape(-1, 1) * slope
            sine = torch.sqrt((1 - co) * (1 + co))
            wo = torch.stack([sine * torch.cos(toward), sine * torch.sin(toward), co], -1).expand(-1, u.shape[1], -1)
            placed = {name: value[:, None] for name, value in take(self.place, cells.row).items()}
            wi, corners = self.model.sample(placed, wo, u).split([ORDER**2, len(CORNERS)], dim=1)
            g = geometry(wi, wo[:, : ORDER**2], self.model.needs | self.model.pdf_needs)
            density = self.model.pdf(placed, g)
            used = g.above & (density > 0)
            factor = torch.where(used, weights * wi[..., 2:] / torch.where(used, density, 1.0), 0.0)
            lowest = torch.where(used, wi[..., 2:], torch.inf).amin(1)
            below = (~used).any(1) | (corners[..., 2:] <= 0).any(1)
            unmet = used.any(1) & below & (lowest > co)
        bases = self.model.basis({name: value[:, None] for name, value in take(own, cells.row).items()}, g)
        parts = torch.stack([basis * factor for basis in torch.broadcast_tensors(*bases, factor)[:-1]], dim=1)
        absolute = parts.detach().abs().sum(2)
        return parts.sum(2), absolute, UNSEEN * absolute * unmet[:, None]

    def solve(self, weights: Tensor, tolerance: float) -> Refined:
        """The integrals to the tolerance, as `refinement.refined` has it."""
        with torch.no_grad():
            return self._solve(weights.expand(len(self.rows.co), -1, -1), tolerance)

    def _solve(self, weights: Tensor, tolerance: float) -> Refined:
        count, device, heeded = len(self.rows.co), self.rows.co.device, weights.clamp(min=LEAST_WEIGHT)
        steps = torch.arange(FIRST, dtype=torch.float64, device=device) / FIRST
        corner = torch.cartesian_prod(steps, steps).repeat(count, 1)
        row = torch.arange(count, device=device).repeat_interleave(FIRST**2)
        cells = Cells(row, corner, torch.full((len(row),), 1 / FIRST, dtype=torch.float64, device=device))
        value, _, doubt = self.integrals(self.place, cells)
        evaluations = len(row) * ORDER**2
        nodes = torch.full((count,), FIRST**2 * ORDER**2, device=device)
        leaves, kept, difference, scale = cells[row < 0], value[row < 0], value[row < 0], value[row < 0]
        while True:
            quarters = cells.quarters()
            parts, sizes, unseen = self.integrals(self.place, quarters)
            evaluations += len(quarters.side) * ORDER**2
            nodes += torch.bincount(quarters.row, minlength=count) * ORDER**2
            # a cell's quarters are leaves, each with a quarter of its doubt
            doubt = torch.maximum((value - parts.unflatten(0, (-1, 4)).sum(1)).abs(), INHERITED * doubt)
            found = torch.maximum(doubt.repeat_interleave(4, dim=0) / 4, unseen)
            leaves = leaves.joined(quarters)
            kept, difference, scale = (torch.cat(pair) for pair in ((kept, parts), (difference, found), (scale, sizes)))
            total, error, absolute = (
                x.new_zeros(count, *x.shape[1:]).index_add_(0, leaves.row, x)
                for x in (kept, SAFETY * difference, scale)
            )
            allowed = tolerance * (weights * total.abs()).sum(1).clamp(min=1)
            open_ = ((heeded * error).sum(1) > allowed).any(1) & (nodes < MOST)
            many = torch.bincount(leaves.row, minlength=count)[leaves.row, None]
            share = SAFETY * (heeded[leaves.row] * difference).sum(1) * many
            coarse = open_[leaves.row] & (share > 0.5 * allowed[leaves.row]).any(1)
            if not bool(coarse.any()):
                break
            cells, value, doubt = leaves[coarse], kept[coarse], difference[coarse]
            leaves, kept, difference, scale = leaves[~coarse], kept[~coarse], difference[~coarse], scale[~coarse]
        self.leaves = leaves
        return Refined(total, error + ROUNDING * absolute, many.new_zeros(count, 2), evaluations)

    def bases(self, own: Values) -> Tensor:
        """The integrals over the cells that were found, for values that may be differentiated."""
        parts, *_ = self.integrals(own, self.leaves)
        return parts.new_zeros(len(self.rows.co), *parts.shape[1:]).index_add(0, self.leaves.row, parts)
