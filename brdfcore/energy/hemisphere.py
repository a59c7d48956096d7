"""Integrals of any lobe: adaptive cells in the unit square of the term's own samples.

    a = integral of f cos theta_i / pdf du over the square,  wi = sample(wo, u)                               [1]

What the samples follow is level in u, so cells need to be small only at the horizon and at kinks. A cell's integral by
a Gauss-Legendre product is compared with the sum over its quarters, which is kept; the differences add up to the error
claimed. Half-vector lobes, and all that have a formula, are integrated faster by their own rules.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from ..geometry import geometry
from ..models import Model
from ..parameters import Values
from .refinement import Refined, Rows, take
from .rules import gauss

ORDER = 8  # nodes along a side of a cell
FIRST = 4  # cells along a side of the square
MOST = 2**18  # nodes a row
CELLS = 2**8  # cells at a time
ROUNDING = 1e-15


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

    def integrals(self, own: Values, cells: Cells) -> tuple[Tensor, Tensor]:
        """The bases' integrals over each cell (N, K, 1 or C), and the same for absolute values."""
        parts = [
            self._of(own, cells[some]) for some in torch.arange(len(cells.side), device=cells.row.device).split(CELLS)
        ]
        return torch.cat([part[0] for part in parts]), torch.cat([part[1] for part in parts])

    def _of(self, own: Values, cells: Cells) -> tuple[Tensor, Tensor]:
        rule = gauss(ORDER).to(cells.row.device)
        s, t = torch.meshgrid(rule.nodes, rule.nodes, indexing="ij")
        weights = (rule.weights[:, None] * rule.weights).reshape(-1, 1) * cells.side.square()[:, None, None]
        co, toward = (v[:, None] for v in self.rows.take(cells.row))
        with torch.no_grad():
            u = cells.corner[:, None] + cells.side[:, None, None] * torch.stack([s, t], -1).reshape(-1, 2)
            sine = torch.sqrt((1 - co) * (1 + co))
            wo = torch.stack([sine * torch.cos(toward), sine * torch.sin(toward), co], -1).expand(-1, u.shape[1], -1)
            placed = {name: value[:, None] for name, value in take(self.place, cells.row).items()}
            wi = self.model.sample(placed, wo, u)
            g = geometry(wi, wo, self.model.needs | self.model.pdf_needs)
            density = self.model.pdf(placed, g)
            used = g.above & (density > 0)
            factor = torch.where(used, weights * wi[..., 2:] / torch.where(used, density, 1.0), 0.0)
        bases = self.model.basis({name: value[:, None] for name, value in take(own, cells.row).items()}, g)
        parts = torch.stack([basis * factor for basis in torch.broadcast_tensors(*bases, factor)[:-1]], dim=1)
        return parts.sum(2), parts.detach().abs().sum(2)

    def solve(self, weights: Tensor, tolerance: float) -> Refined:
        """The integrals to the tolerance, as `refinement.refined` has it."""
        with torch.no_grad():
            return self._solve(weights.expand(len(self.rows.co), -1, -1), tolerance)

    def _solve(self, weights: Tensor, tolerance: float) -> Refined:
        count, device = len(self.rows.co), self.rows.co.device
        steps = torch.arange(FIRST, dtype=torch.float64, device=device) / FIRST
        corner = torch.cartesian_prod(steps, steps).repeat(count, 1)
        row = torch.arange(count, device=device).repeat_interleave(FIRST**2)
        cells = Cells(row, corner, torch.full((len(row),), 1 / FIRST, dtype=torch.float64, device=device))
        value, _ = self.integrals(self.place, cells)
        evaluations = len(row) * ORDER**2
        nodes = torch.full((count,), FIRST**2 * ORDER**2, device=device)
        leaves, kept, difference, scale = cells[row < 0], value[row < 0], value[row < 0], value[row < 0]
        while True:
            quarters = cells.quarters()
            parts, sizes = self.integrals(self.place, quarters)
            evaluations += len(quarters.side) * ORDER**2
            nodes += torch.bincount(quarters.row, minlength=count) * ORDER**2
            # a cell's quarters are leaves, each with a quarter of the difference
            found = (value - parts.unflatten(0, (-1, 4)).sum(1)).abs().repeat_interleave(4, dim=0) / 4
            leaves = leaves.joined(quarters)
            kept, difference, scale = (torch.cat(pair) for pair in ((kept, parts), (difference, found), (scale, sizes)))
            total, error, absolute = (
                x.new_zeros(count, *x.shape[1:]).index_add_(0, leaves.row, x) for x in (kept, difference, scale)
            )
            allowed = tolerance * (weights * total.abs()).sum(1).clamp(min=1)
            open_ = ((weights * error).sum(1) > allowed).any(1) & (nodes < MOST)
            many = torch.bincount(leaves.row, minlength=count)[leaves.row, None]
            share = (weights[leaves.row] * difference).sum(1) * many
            coarse = open_[leaves.row] & (share > 0.5 * allowed[leaves.row]).any(1)
            if not bool(coarse.any()):
                break
            cells, value = leaves[coarse], kept[coarse]
            leaves, kept, difference, scale = leaves[~coarse], kept[~coarse], difference[~coarse], scale[~coarse]
        self.leaves = leaves
        return Refined(total, error + ROUNDING * absolute, many.new_zeros(count, 2), evaluations)

    def bases(self, own: Values) -> Tensor:
        """The integrals over the cells that were found, for values that may be differentiated."""
        parts, _ = self.integrals(own, self.leaves)
        return parts.new_zeros(len(self.rows.co), *parts.shape[1:]).index_add(0, self.leaves.row, parts)
