"""Makes a table of albedos: how many nodes each axis needs, the values at them, and what lies between, checked.

The nodes of an axis are counted on lines through the box: where the Chebyshev coefficients of the albedo along a line,
beyond some degree, sum to less than the axis's share of the tolerance, the degree suffices there. Each line is sampled
at nested nodes until it is resolved. The full grid is computed once, and compared with the albedo itself at random
points, which lie as densely as the nodes do; where they differ by too much, lines through the worst point count again.

A parameter that no basis of the material reads (a reflectance) costs next to nothing: its values go through the
quadrature side by side, as channels do.
"""

import itertools
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import torch
from torch import Tensor

from ..errors import InvalidValueError
from ..geometry import geometry
from ..models.form import Form
from ..models.material import Material
from . import _axes, _chebyshev
from ._axes import LOWEST, PHI, Axis
from .albedo import of_form
from .probe import growth, pairs, symmetry
from .scan import lone_terms

MOST = 2**20  # numbers in a table
LONGEST = 257  # nodes along a line
ROUNDS = 4  # of counting again after a check
CHECKS = (128, 2048)  # fewest and most points between the nodes that are checked
SAFETY = 2.0  # what is claimed, over the largest difference found
QUADRATURE = 0.1  # of the tolerance, for each value
LINES = 0.05  # of an axis's share, for each value on a line: the coefficients of n random errors add up to sqrt(2 n)
BLOCK = 1024  # rows between two words of progress
SEED = 20100629
_ANGLES = ("theta", "phi")

Rows = Mapping[str, Tensor]  # axis -> values, all of one length; of phi they are phi'


@dataclass
class Quadrature:
    """Albedos at rows of the table's axes, and what they cost."""

    form: Form
    fixed: dict[str, Tensor]
    channels: int
    report: Callable[[float], None]
    evaluations: int = 0
    worst: float = 0.0  # the largest error claimed, as a share of max(1, albedo)
    ratios: tuple[_axes.Ratio, ...] = field(init=False)

    def __post_init__(self) -> None:
        self.ratios = _axes.ratios(self.form)

    def __call__(self, rows: Rows, levels: Rows, tolerance: float, share: tuple[float, float] | None = None) -> Tensor:
        """The albedos (P, R, C) for P rows of angles and shapes, and R of what no basis reads."""
        many = max((len(level) for level in levels.values()), default=1)
        side_by_side = {key: value.repeat(many) for key, value in self.fixed.items() if value.ndim == 1}
        side_by_side |= {key: level.repeat_interleave(self.channels) for key, level in levels.items()}
        count, found = len(rows["theta"]), []
        for start in range(0, count, BLOCK):
            block = {name: row[start : start + BLOCK] for name, row in rows.items()}
            co = torch.cos(block["theta"]).clamp(min=LOWEST)
            azimuth = torch.zeros_like(co)
            if "phi" in block:
                factor = _axes.stretch(self.ratios, self.form, self.fixed | block)
                azimuth = torch.atan2(torch.sin(block["phi"]) * factor, torch.cos(block["phi"]))
            shapes = {key: value[:, None] for key, value in block.items() if key not in _ANGLES}
            with torch.no_grad():
                albedo = of_form(self.form, self.fixed | side_by_side | shapes, co, azimuth, tolerance)
            self.evaluations += albedo.evaluations
            sound = (albedo.values.isfinite() & albedo.error.isfinite()).all(-1)
            if not bool(sound.all()):
                at = {name: float(row[~sound][0]) for name, row in block.items()}
                raise InvalidValueError(
                    "Expected the albedo to be a finite number all over the table, got none at "
                    f"{', '.join(f'{name} = {value:.6g}' for name, value in at.items())}. Narrow the axes.",
                    field="axes",
                )
            self.worst = max(self.worst, float((albedo.error / albedo.values.clamp(min=1)).max()))
            found.append(albedo.values.expand(-1, many * self.channels))
            if share is not None:
                self.report(share[0] + (share[1] - share[0]) * min(1.0, (start + BLOCK) / count))
        return torch.cat(found).reshape(count, many, self.channels)


def tabulate(
    material: Material, chosen: tuple[Axis, ...], tolerance: float, progress: Callable[[float], None] | None
) -> dict[str, Any]:
    """The fields of the table, for axes without phi: it is added here where the material is anisotropic."""
    start = time.perf_counter()
    work = _work(material, chosen, tolerance, progress)
    axes, quadrature, unread = work.axes, work.quadrature, work.unread
    work.require_end()
    # what counting leaves to each axis; along what no basis reads there is hardly an error
    counts, share = {}, tolerance / (2 * (len(axes) - len(unread)))
    for number, axis in enumerate(axes):
        counts[axis.name] = work.count(axis, share)
        quadrature.report(0.2 * (number + 1) / len(axes))
    for _ in range(ROUNDS):
        size = math.prod(counts.values()) * material.channels
        if size > MOST:
            shown = " x ".join(f"{name} {count}" for name, count in counts.items())
            raise InvalidValueError(
                f"Expected the table to take at most {MOST} numbers, got {size} ({shown}, {material.channels} "
                "channels). Narrow an axis, leave one out, or allow a larger tolerance.",
                field="axes",
            )
        values = work.grid(counts)
        error, worst = work.check(values)
        if error <= tolerance or quadrature.worst > tolerance / 2:
            break
        share /= 2
        counts = {axis.name: max(counts[axis.name], work.count(axis, share, worst)) for axis in axes}
    return {
        "axes": axes,
        "values": values,
        "error": error,
        "met": error <= tolerance,
        "evaluations": quadrature.evaluations,
        "seconds": time.perf_counter() - start,
    }


def require_end(material: Material, chosen: tuple[Axis, ...], tolerance: float) -> None:
    """Raise what `tabulate` would of a theta without an end, where the growth of a term's own values foretells it.

    That takes a few milliseconds, and an integral only where a term grows.
    """
    if chosen[0].high == math.pi / 2:
        work = _work(material, chosen, tolerance, None)
        if work.grows():
            work.require_end()


def _work(
    material: Material, chosen: tuple[Axis, ...], tolerance: float, progress: Callable[[float], None] | None
) -> "_Work":
    """The steps of making a table, for axes without phi."""
    form = material.form
    fixed = {key: value.detach().double() for key, value in material.values().items()}
    quadrature = Quadrature(form, fixed, material.channels, progress or (lambda fraction: None))
    axes = (chosen[0], *((PHI,) if _anisotropic(form, fixed, chosen[1:]) else ()), *chosen[1:])
    unread = _unread(form, fixed, [axis.name for axis in chosen[1:]])
    return _Work(axes, unread, quadrature, tolerance, torch.Generator().manual_seed(SEED))


def _unread(form: Form, fixed: dict[str, Tensor], keys: list[str]) -> frozenset[str]:
    """Those of the keys that no basis reads; none where a tie has a total a channel, which leaves no room beside it."""
    if not keys or any(tie.total is not None and len(tie.total) > 1 for tie in form.ties.values()):
        return frozenset()
    leaves = {key: value.clone().requires_grad_() for key, value in fixed.items()}
    with torch.enable_grad():
        g = geometry(*pairs(), form.needs)
        bases = [basis for term in form.terms for basis in term.model.basis(form.of_term(term, leaves), g)]
        total = torch.stack([basis.sum() for basis in bases]).sum()
        if not total.requires_grad:
            return frozenset(keys)
        gradients = torch.autograd.grad(total, [leaves[key] for key in keys], allow_unused=True)
    return frozenset(key for key, gradient in zip(keys, gradients, strict=True) if gradient is None)


def _anisotropic(form: Form, fixed: dict[str, Tensor], axes: tuple[Axis, ...]) -> bool:
    """Whether the azimuth matters anywhere in the box: at three points at which no two axes have the same place."""
    for step in (0.17, 0.31, 0.43):
        places = {axis.name: torch.tensor(math.cos(1 + step * (k + 1))).double() for k, axis in enumerate(axes)}
        values = fixed | {axis.name: axis.values(places[axis.name]) for axis in axes}
        if not symmetry(form, values).isotropic:
            return True
    return False


@dataclass(frozen=True)
class _Work:
    """The steps of making one table."""

    axes: tuple[Axis, ...]
    unread: frozenset[str]
    quadrature: Quadrature
    tolerance: float
    generator: torch.Generator

    def points(self, axes: list[Axis], corners: int, inside: int) -> dict[str, Tensor]:
        """Values at some of the box's corners and at random points inside, which lie as densely as nodes do."""
        every = list(itertools.product((1.0, -1.0), repeat=len(axes)))
        chosen = torch.randperm(len(every), generator=self.generator)[:corners]
        ends = torch.tensor(every, dtype=torch.float64).reshape(len(every), len(axes))[chosen]
        drawn = torch.cos(math.pi * torch.rand(inside, len(axes), dtype=torch.float64, generator=self.generator))
        places = torch.cat([ends, drawn])
        return {axis.name: axis.values(places[:, k]) for k, axis in enumerate(axes)}

    def split(self) -> tuple[list[Axis], list[Axis]]:
        """The axes that make rows, and those that go side by side."""
        return [a for a in self.axes if a.name not in self.unread], [a for a in self.axes if a.name in self.unread]

    def grows(self) -> bool:
        """Whether at some corner of the box the values of a term grow towards grazing."""
        form, fixed = self.quadrature.form, self.quadrature.fixed
        points = self.points([axis for axis in self.axes if axis.name not in _ANGLES], 8, 0)
        count = max((len(p) for p in points.values()), default=1)
        corners = (fixed | {name: p[k] for name, p in points.items()} for k in range(count))
        return any((growth(lone.form, lone.values) or 0) > 0 for at in corners for lone in lone_terms(form, at))

    def require_end(self) -> None:
        """Raise where theta has no end and the albedo does not settle towards the horizon."""
        theta = self.axes[0]
        if theta.high < math.pi / 2:
            return
        row_axes, level_axes = self.split()
        points = self.points(row_axes[1:], 8, 0) or {}
        count = max((len(p) for p in points.values()), default=1)
        heights = torch.tensor([1e-9, LOWEST], dtype=torch.float64)
        rows = {name: value.repeat_interleave(2) for name, value in points.items()}
        rows["theta"] = math.pi / 2 - heights.repeat(count)
        levels = self.points(level_axes, 4, 0)
        found = self.quadrature(rows, levels, QUADRATURE * self.tolerance)
        near, nearest = found.unflatten(0, (count, 2)).unbind(1)
        allowed = (self.tolerance + 2 * self.quadrature.worst) * near.clamp(min=1)
        if bool(((nearest - near).abs() > allowed).any()):
            raise InvalidValueError(
                f"Expected the axis theta to end before the horizon for {self.quadrature.form.text()}, since its "
                "albedo grows without bound towards it, got no end. Give it one, such as 1.5 (86 for theta_deg).",
                field="axes",
            )

    def count(self, axis: Axis, share: float, through: Rows | None = None) -> int:
        """The nodes that the axis needs for a share of the error, on lines through a point, or through several."""
        row_axes, level_axes = ([a for a in group if a != axis] for group in self.split())
        if through is None:
            rows, levels = self.points(row_axes, 4, 4), self.points(level_axes, 4, 0)
        else:
            rows, levels = ({a.name: through[a.name] for a in group} for group in (row_axes, level_axes))
        lines = max((len(row) for row in rows.values()), default=1)
        many = max((len(level) for level in levels.values()), default=1)

        def along(places: Tensor) -> Tensor:
            """The albedos (n, lines, levels, C) at places on the axis."""
            here, n = axis.values(places), len(places)
            found: Tensor
            if axis.name in self.unread:
                spread = {name: level.repeat(n) for name, level in levels.items()}
                spread[axis.name] = here.repeat_interleave(many)
                found = self.quadrature(rows, spread, LINES * share).unflatten(1, (n, many)).movedim(1, 0)
            else:
                spread = {name: row.repeat(n) for name, row in rows.items()}
                spread[axis.name] = here.repeat_interleave(lines)
                found = self.quadrature(spread, levels, LINES * share).unflatten(0, (n, lines))
            return found

        n = 3 if axis.name in self.unread else 9
        values = along(_chebyshev.nodes(n))
        while True:
            # where the quadrature is not as good as asked, its errors are not to be resolved
            allowed = max(share, self.quadrature.worst)
            needed = _chebyshev.needed(_chebyshev.coefficients(values, 1), allowed)
            if needed <= 0.75 * n or n >= LONGEST:
                return max(2, needed)
            n = 2 * n - 1
            between = along(_chebyshev.nodes(n)[1::2])
            values = torch.cat([torch.stack([values[:-1], between], 1).flatten(0, 1), values[-1:]])

    def grid(self, counts: Mapping[str, int]) -> Tensor:
        """The albedos at all nodes, (n_1, ..., n_d, C)."""
        row_axes, level_axes = self.split()
        rows, levels = (
            torch.meshgrid(*(axis.nodes(counts[axis.name]) for axis in group), indexing="ij") if group else ()
            for group in (row_axes, level_axes)
        )
        found = self.quadrature(
            {axis.name: row.flatten() for axis, row in zip(row_axes, rows, strict=True)},
            {axis.name: level.flatten() for axis, level in zip(level_axes, levels, strict=True)},
            QUADRATURE * self.tolerance,
            (0.2, 0.8),
        )
        made = [*row_axes, *level_axes]
        shaped = found.reshape(*(counts[axis.name] for axis in made), found.shape[-1])
        return shaped.permute(*(made.index(axis) for axis in self.axes), len(made)).contiguous()

    def check(self, values: Tensor) -> tuple[float, dict[str, Tensor]]:
        """The error that is claimed, and the point at which the largest difference was found."""
        row_axes, level_axes = self.split()
        points = min(max(values.numel() // 4, CHECKS[0]), CHECKS[1])
        rows, levels = self.points(row_axes, 16, points), self.points(level_axes, 2, 2)
        self.quadrature.worst, grid = 0.0, self.quadrature.worst
        exact = self.quadrature(rows, levels, QUADRATURE * self.tolerance, (0.8, 1.0))
        x = [
            axis.x(levels[axis.name][None] if axis.name in self.unread else rows[axis.name][:, None])
            for axis in self.axes
        ]
        between = _chebyshev.contract(_chebyshev.coefficients(values, len(self.axes)), x)
        difference = ((between - exact).abs() / exact.clamp(min=1)).amax(-1)
        row, level = divmod(int(difference.argmax()), difference.shape[1])
        at = {name: value[row : row + 1] for name, value in rows.items()}
        at |= {name: value[level : level + 1] for name, value in levels.items()}
        self.quadrature.worst = max(grid, self.quadrature.worst)
        return SAFETY * float(difference.max()) + self.quadrature.worst, at
