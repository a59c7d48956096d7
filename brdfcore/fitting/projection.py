"""Variable projection: the reflectances solved for exactly at any shapes, and the normal equations of those alone.

The loss is |F z + o - y|^2 with the unknowns z; at the best z its gradient by the shapes p is that of o + F z with z
held (Golub and Pereyra 1973), and Kaufman's Jacobian (1975) is that derivative without its part in the span of F:

    H = V^T V - V^T F (F^T F)^-1 F^T V,    V = d(o + F z)/dp,

over the columns of F that are free in their polytope. F, V and y are mixed from the bases and their derivatives, so
one product of those, [b | db/dp | y]^T [b | db/dp | y], summed in float64 over pieces of the data, serves all channels.
"""

import functools
from typing import NamedTuple

import torch
from torch import Tensor

from ..parameters import Values
from .problem import Gram, Problem, linear_factor, rows_of
from .solve import MOST, Block, Faces, dot, solve_box, solve_faces, times
from .unknowns import Group, groups, natural_of


class Products(NamedTuple):
    """Weighted sums over the samples of products of Q columns, W = 1 where they serve all channels."""

    columns: Tensor  # (..., W, Q, Q)
    data: Tensor  # (..., C, Q)
    squares: Tensor  # (..., C)

    def pick(self, *index: Tensor) -> "Products":
        """Those at an index of the leading shape (...), to which all broadcast."""
        lead = torch.broadcast_tensors(self.columns[..., 0, 0, 0], self.data[..., 0, 0])[0].shape
        return Products(*(part.expand(*lead, *part.shape[len(lead) :])[index] for part in self))


class Affine(NamedTuple):
    """The coefficients c = offset + A z at given shapes, and their derivatives by raw values."""

    offset: Tensor  # (S, C, K)
    a: Tensor  # (S, C, K, L)
    offset_slopes: Tensor  # (S, C, K, P)
    a_slopes: Tensor  # (S, C, K, L, P)


class Solved(NamedTuple):
    """The unknowns at given shapes."""

    z: Tensor  # (..., C, L)
    directions: Tensor  # (..., C, L, L) of the face that each channel is on, or (..., D, D) of all together
    loss: Tensor  # (...)


class Projection:
    """A problem whose residuals are linear in f, seen as one of its shapes alone."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.groups: tuple[Group, ...] = groups(problem.plan) if problem.linear else ()
        self.count = sum(group.count for group in self.groups)
        self.unknown_keys = list({key: None for group in self.groups for key in (group.scale, group.f0) if key})
        self.shapes = [p for p, key in enumerate(problem.keys) if key not in self.unknown_keys]
        self.searched = torch.tensor([p in self.shapes for p in range(len(problem.keys))])
        if not self.groups:
            return
        start = problem.plan.start
        gray = [start[group.scale].numel() == 1 for group in self.groups for _ in range(group.count)]
        self.merged = all(gray) and problem.channels > 1  # one set of unknowns for all channels
        self.mixed = problem.channels > 1 and any(gray) and not all(gray)
        solvers = 1 if self.merged else problem.channels
        blocks = self._blocks(solvers)
        self.faces = None if self.mixed or self.count > MOST else Faces.of(blocks)
        begins = torch.tensor([0, *(1 if one else problem.channels for one in gray)]).cumsum(0)
        within = torch.arange(problem.channels).unsqueeze(-1)
        self.place = torch.where(torch.tensor(gray), begins[:-1], begins[:-1] + within)  # (C, L), in a dense system
        self.size = int(begins[-1])
        ends = torch.zeros(2, self.size, dtype=torch.float64)
        for block in blocks:
            for i in block.at:
                ends[0, self.place[:, i]] = block.low.expand(problem.channels)
                ends[1, self.place[:, i]] = block.high.expand(problem.channels)
        self.low, self.high = ends
        # two points of each unknown, in the box: a total minus it stops at its own ends, so is a line only within
        boxed = torch.tensor([group.kind == "scale" for group in self.groups for _ in range(group.count)])
        low, high = self.low[self.place], self.high[self.place]
        self.base = torch.where(boxed, low, 0.0)  # (C, L)
        self.step = torch.where(boxed & (high > low), high - low, 1.0)

    @property
    def useful(self) -> bool:
        """Whether there is something to solve for."""
        return bool(self.groups)

    @property
    def may_leave_the_box(self) -> bool:
        """Whether what is solved for may lie outside the box: an absorbed kd, or a pair solved in no triangle."""
        kinds = [group.kind for group in self.groups]
        triangles = self.useful and self.faces is not None
        return ("absorbed" in kinds and "pair" in kinds) or (not triangles and bool({"pair", "absorbed"} & set(kinds)))

    def _blocks(self, solvers: int) -> tuple[Block, ...]:
        """The blocks of the polytope; kd <= 1 of what a pair's f0 absorbs is no plane and is left out."""
        problem = self.problem
        ones = torch.ones(solvers, dtype=torch.float64)
        made: list[Block] = []
        absorbed = {group.f0: group for group in self.groups if group.kind == "absorbed"}
        for group in self.groups:
            at = problem.slices[group.scale]
            low, high = problem.low[at].expand(solvers), problem.high[at].expand(solvers)
            if group.kind == "pair":
                made.append(Block((group.at, group.at + 1), 0 * ones, high))
            elif group.kind == "f0" and group.f0 in absorbed:
                made.append(Block((group.at, absorbed[group.f0].at), 0 * ones, ones))
            elif group.kind != "absorbed":
                made.append(Block((group.at,), low, high))
            elif not any(other.kind == "f0" and other.f0 == group.f0 for other in self.groups):
                made.append(Block((group.at,), 0 * ones, torch.inf * ones))
        return tuple(made)

    @functools.cached_property
    def _corners(self) -> dict[str, Tensor]:
        """Natural values of unknowns at their base, then one step from it along each, (L + 1, 1, 1, C)."""
        away = torch.cat([torch.zeros(1, self.count), torch.eye(self.count)]).to(self.base)
        none = torch.zeros(1).to(self.base)
        found = natural_of(self.groups, self.base + away[:, None] * self.step, dict.fromkeys(self.unknown_keys, none))
        return {key: value[:, None, None] for key, value in found.items()}

    def affine(self, x: Tensor, natural: Values, *, slopes: bool = True) -> Affine:
        """The coefficients as functions of the unknowns at the shapes of x (S, D), and its natural values."""
        if self._shaped:
            return self._affine(x, natural, slopes=slopes)
        return Affine(*(part.expand(len(x), *part.shape[1:]) for part in self._same))

    @functools.cached_property
    def _shaped(self) -> bool:
        """Whether coefficients read what is searched; else they are the same in all rows."""
        return any(p in self.shapes for _, p in self.problem.columns.coefficient_derivatives)

    @functools.cached_property
    def _same(self) -> Affine:
        """The coefficients of one row."""
        x = self.problem.pack(self.problem.plan.start).unsqueeze(0)
        return self._affine(x, self.problem.natural(x), slopes=False)

    def _affine(self, x: Tensor, natural: Values, *, slopes: bool) -> Affine:
        problem = self.problem
        shape = (self.count + 1, len(x), 1, problem.channels)
        values = {**natural, **self._corners}
        c = problem.columns.coefficients(values, shape).squeeze(2)  # (L + 1, S, C, K)
        names = len(problem.keys)
        if slopes and self._shaped:
            d = problem.columns.coefficient_slopes(values, shape).squeeze(2) * problem.chain(x).unsqueeze(-2)
        else:
            d = c.new_zeros(1, 1, 1, 1, names).expand(*c.shape, names)
        step = self.step.T[:, None, :, None]  # (L, 1, C, 1)
        a, a_slopes = (c[1:] - c[0]) / step, (d[1:] - d[0]) / step.unsqueeze(-1)
        base = self.base.T[:, None, :, None]
        offset, offset_slopes = c[0] - (a * base).sum(0), d[0] - (a_slopes * base.unsqueeze(-1)).sum(0)
        return Affine(offset, a.movedim(0, -1), offset_slopes, a_slopes.movedim(0, -2))

    @functools.cached_property
    def _weighed(self) -> tuple[Tensor, Tensor, Tensor]:
        """What multiplies f - y in the residuals, (M, C, N) or broadcasting; that times y; its sums of squares."""
        data = self.problem.data
        factor = linear_factor(self.problem.loss_kind, data)
        y = factor * data.y
        return factor, y, y.square().sum(-1)

    def products(self, starts: int, natural: Values, which: Tensor | None, *, derivatives: bool = True) -> Products:
        """The products at each row's values, its own material's data: (S, W, Q, Q), (S, C, Q), (S, C)."""
        problem = self.problem
        problem.evaluations += starts
        evaluate = problem.columns.all if derivatives else problem.columns.values
        factor, y, squares = self._weighed
        own = which if which is not None and len(y) > 1 else None
        parts: dict[int, list[tuple[Tensor, ...]]] = {}
        for rows, begin, piece in problem.data.blocks(starts):
            columns = evaluate(rows_of(natural, rows), piece.g, rows.stop - rows.start, problem.channels)
            at = slice(begin, begin + len(piece.c))
            right, weight = y[..., at], factor[..., at].unsqueeze(2)
            if own is not None:
                right = right.index_select(0, own[rows])
                weight = weight if len(factor) == 1 else weight.index_select(0, own[rows])
            weighed = columns.mul_(weight) if weight.shape[1] <= columns.shape[1] else columns * weight
            if weighed.shape[1] == 1:
                data = (weighed[:, 0] @ right.mT).mT
            else:
                data = (weighed @ right.unsqueeze(-1)).squeeze(-1)
            parts.setdefault(rows.start, []).append((weighed @ weighed.mT, data))
        gram, data = (_joined(each) for each in zip(*map(_summed, parts.values()), strict=True))
        return Products(gram, data, (squares if own is None else squares[own]).expand(starts, -1))

    def scan_products(self, starts: int, natural: Values) -> Products:
        """The products of the bases at each row's values with the data of all materials: lead (S, M), or (S, 1)."""
        problem = self.problem
        problem.evaluations += starts
        factor, y, squares = self._weighed
        parts: list[tuple[Tensor, ...]] = []
        for begin, piece in problem.data.places(starts):
            columns = problem.columns.values(natural, piece.g, starts, problem.channels)  # (S, W, K, N)
            at = slice(begin, begin + len(piece.c))
            weight, here = factor[..., at], y[..., at]
            if columns.shape[1] == 1 and weight.shape[:2] == (1, 1):  # one product serves every material and channel
                weighed = columns.mul_(weight)
                flat = weighed.reshape(-1, weighed.shape[-1]) @ here.reshape(-1, here.shape[-1]).T  # (S K, M C)
                right = flat.reshape(starts, -1, *here.shape[:2]).permute(0, 2, 3, 1)
                gram = (weighed @ weighed.mT).unsqueeze(1)
            else:
                weighed = columns.unsqueeze(1) * weight.unsqueeze(2)  # (S, M, W, K, N)
                right = (weighed.expand(-1, -1, problem.channels, -1, -1) @ here.unsqueeze(-1)).squeeze(-1)
                gram = weighed @ weighed.mT
            parts.append((gram, right))
        gram, right = _summed(parts)
        return Products(gram, right, squares.unsqueeze(0))

    def solve(self, products: Products, offset: Tensor, a: Tensor, *, ends: bool = True) -> Solved:
        """The unknowns and the loss for products of leading shape (...) and coefficients offset + A z.

        Where there are faces, the unknowns may also be solved for without the ends of their polytope.
        """
        bases = self.problem.columns.bases
        g = products.columns[..., :bases, :bases]
        right = products.data[..., :bases]
        gz = a.mT @ g @ a  # (..., C, L, L)
        g_offset = times(g, offset)
        rz = times(a.mT, right - g_offset)
        lead = rz.shape[:-2]
        channels = self.problem.channels
        gz = gz.expand(*lead, channels, self.count, self.count)
        if self.mixed:
            dense_g, dense_r = self.scatter(gz.flatten(0, -4), rz.flatten(0, -3))
            z, free = solve_box(dense_g, dense_r, self.low, self.high)
            z = z[:, self.place].reshape(*lead, channels, self.count)
            directions = torch.diag_embed(free.to(z)).reshape(*lead, self.size, self.size)
        else:
            if self.merged:
                gz_, rz_ = gz.sum(-3, keepdim=True), rz.sum(-2, keepdim=True)
            else:
                gz_, rz_ = gz, rz
            if self.faces is None:
                low, high = (end[self.place[: gz_.shape[-3]]] for end in (self.low, self.high))
                z, free = solve_box(gz_, rz_, low, high)
                directions = torch.diag_embed(free.to(z))
            else:
                z, directions = solve_faces(self.faces, gz_, rz_, ends=ends)
            z = z.expand(*lead, channels, self.count)
        loss = products.squares + dot(offset, g_offset - 2 * right) + dot(z, times(gz, z) - 2 * rz)
        return Solved(z, directions, loss.sum(-1))

    def outside(self, z: Tensor) -> Tensor:
        """Where the unknowns z (..., C, L), solved for without their ends, lie outside the polytope, (...) bool."""
        if self.faces is None:
            return torch.zeros(z.shape[:-2], dtype=torch.bool)
        return self.faces.outside(z).any(-1)

    def scatter(self, gram: Tensor, right: Tensor) -> tuple[Tensor, Tensor]:
        """Systems by channel (B, C, L, L), (B, C, L) summed into the dense one (B, D, D), (B, D)."""
        rows = len(right)
        flat = self.place.reshape(-1)
        dense_r = right.new_zeros(rows, self.size).index_add_(1, flat, right.reshape(rows, -1))
        both = (self.place.unsqueeze(-1) * self.size + self.place.unsqueeze(-2)).reshape(-1)
        dense_g = right.new_zeros(rows, self.size**2).index_add_(1, both, gram.reshape(rows, -1))
        return dense_g.reshape(rows, self.size, self.size), dense_r

    def write(self, x: Tensor, natural: Values, z: Tensor) -> Tensor:
        """The rows x (S, D), and its natural values, with the unknowns z (S, C, L) in them, put into the box."""
        problem = self.problem
        otherwise = {key: natural[key].squeeze(1) for key in self.unknown_keys}
        x = x.clone()
        for key, value in natural_of(self.groups, z, otherwise).items():
            at = problem.slices[key]
            x[:, at] = problem.plan.form.parameters[key].to_raw(value[:, : at.stop - at.start])
        return x.clamp(problem.low, problem.high)

    def solved(self, x: Tensor, which: Tensor | None = None) -> tuple[Tensor, Tensor]:
        """The rows with their unknowns solved for, and their loss (S,)."""
        natural = self.problem.natural(x)
        affine = self.affine(x, natural, slopes=False)
        found = self.solve(self.products(len(x), natural, which, derivatives=False), affine.offset, affine.a)
        return self.write(x, natural, found.z), found.loss

    def gram(self, x: Tensor, which: Tensor | None = None) -> tuple[Tensor, Gram]:
        """The rows with their unknowns solved for, and the normal equations of the shapes alone, 0 elsewhere."""
        problem = self.problem
        natural = problem.natural(x)
        products, affine = self.products(len(x), natural, which), self.affine(x, natural)
        solved = self.solve(products, affine.offset, affine.a)
        z, a = solved.z, affine.a
        c = affine.offset + (a @ z.unsqueeze(-1)).squeeze(-1)
        slopes = affine.offset_slopes + (affine.a_slopes * z[:, :, None, :, None]).sum(-2)
        columns = problem.columns
        value, v = columns.mix(c, torch.zeros_like(slopes), problem.chain(x))
        v[..., : columns.bases, :] = slopes  # raw already
        v = v * self.searched
        gv = products.columns @ v  # (S, C, Q, P)
        residual = (products.columns @ value.unsqueeze(-1)).squeeze(-1) - products.data
        gradient = (v.mT @ residual.unsqueeze(-1)).squeeze(-1)
        matrix = v.mT @ gv
        across = a.mT @ gv[..., : columns.bases, :]  # (S, C, L, P), F^T V
        inner = a.mT @ products.columns[..., : columns.bases, : columns.bases] @ a
        x = self.write(x, natural, z)
        whole = problem.scatter_matrix(matrix)
        d = solved.directions
        if self.mixed or self.merged:
            dense, _ = self.scatter(inner.expand(*z.shape, self.count), torch.zeros_like(z))
            left, d = self._scatter_across(across), d if self.mixed else d.squeeze(-3)
            projected = whole - _projected(d.mT @ dense @ d, d.mT @ left)
        else:
            projected = problem.scatter_matrix(matrix - _projected(d.mT @ inner @ d, d.mT @ across))
        lost = projected.diagonal(dim1=-2, dim2=-1) <= 1e-12 * whole.diagonal(dim1=-2, dim2=-1)
        projected = projected.masked_fill(lost.unsqueeze(-1) | lost.unsqueeze(-2), 0.0)
        gradient = problem.scatter_vector(gradient).masked_fill(lost, 0.0)
        return x, Gram(solved.loss, gradient, projected)

    def _scatter_across(self, across: Tensor) -> Tensor:
        """(S, C, L, P) by channel, summed into (S, unknowns, D)."""
        problem = self.problem
        flat = (self.place.unsqueeze(-1) * problem.size + problem.index.unsqueeze(-2)).reshape(-1)
        out = across.new_zeros(len(across), self.size * problem.size)
        return out.index_add_(1, flat, across.reshape(len(across), -1)).reshape(-1, self.size, problem.size)


def _joined(parts: tuple[Tensor, ...]) -> Tensor:
    return parts[0] if len(parts) == 1 else torch.cat(parts)


def _summed(parts: list[tuple[Tensor, ...]]) -> list[Tensor]:
    if len(parts) == 1:
        return list(parts[0])
    return [torch.stack(each).sum(0) for each in zip(*parts, strict=True)]


def _projected(inner: Tensor, across: Tensor) -> Tensor:
    """across^T inner^-1 across, without what is not free: (..., L, L), (..., L, P) -> (..., P, P)."""
    diagonal = inner.diagonal(dim1=-2, dim2=-1)
    scale = torch.where(diagonal > 0, diagonal.clamp(min=1e-300).rsqrt(), 0.0)
    ridge = torch.where(diagonal > 0, 1e-13, 1.0)
    scaled = scale.unsqueeze(-1) * inner * scale.unsqueeze(-2) + torch.diag_embed(ridge)
    left = scale.unsqueeze(-1) * across
    solution: Tensor = torch.linalg.solve_ex(scaled, left)[0]
    return left.mT @ solution
