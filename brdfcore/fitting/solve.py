"""The reflectances that minimise a quadratic inside their box, exactly and in batches.

    minimise z^T G z - 2 r^T z  over a polytope

Up to `MOST` unknowns a channel, every face of the polytope is solved as if it were a plane, and the best of those
solutions that lie in the polytope is the minimum: first the faces with reflectances at 0, then, only where one exceeds
its upper end, all of them. More unknowns, or gray ones beside coloured ones, are solved by exchanging active ends.
"""

import itertools
from dataclasses import dataclass, replace

import torch
from torch import Tensor

MOST = 5
_RIDGE = 1e-13  # of the scaled diagonal: two equal columns share their reflectance, and nothing is divided by 0
_EXCHANGES = 20  # of all wrong ends at once; then one at a time, which ends


@dataclass(frozen=True)
class Block:
    """Unknowns with ends in common: a triangle z_i, z_j >= 0, z_i + z_j <= cap, or one with a box, or one above 0."""

    at: tuple[int, ...]
    low: Tensor  # (C,)
    high: Tensor  # (C,) the cap of a triangle; infinite where there is none

    def faces(self) -> list[tuple[bool, Tensor, Tensor]]:
        """Whether a face touches the upper end, its origin (C, n) and its directions (n, n)."""
        zero = torch.zeros_like(self.low)
        if len(self.at) == 1:
            one, none = torch.eye(1, dtype=torch.float64), torch.zeros(1, 1, dtype=torch.float64)
            found = [(False, self.low, one), (False, self.low, none), (True, self.high, none)]
            return [(upper, o.unsqueeze(-1), d) for upper, o, d in found if bool(o.isfinite().all())]
        corner, tip_i, tip_j = (torch.stack(p, dim=-1) for p in ((zero, zero), (self.high, zero), (zero, self.high)))
        inner, along_i, along_j, edge, none = torch.tensor(
            [[[1, 0], [0, 1]], [[1, 0], [0, 0]], [[0, 0], [0, 1]], [[1, 0], [-1, 0]], [[0, 0], [0, 0]]],
            dtype=torch.float64,
        )
        return [
            *((False, corner, directions) for directions in (inner, along_i, along_j, none)),
            (True, tip_j, edge),
            (True, tip_i, none),
            (True, tip_j, none),
        ]


@dataclass(frozen=True)
class Faces:
    """The faces of the polytope of every channel: z = origin + directions t."""

    blocks: tuple[Block, ...]
    origin: Tensor  # (F, C, L)
    directions: Tensor  # (F, L, L), 0 in the columns of what the face holds
    lower: int  # how many of the first faces touch no upper end
    along_axes: bool  # every face: no triangle's slanted edge is among them

    @classmethod
    def of(cls, blocks: tuple[Block, ...]) -> "Faces":
        """The faces of the product of the blocks."""
        count = sum(len(block.at) for block in blocks)
        made = []
        for choice in itertools.product(*(block.faces() for block in blocks)):
            origin = torch.zeros(len(blocks[0].low), count, dtype=torch.float64)
            directions = torch.zeros(count, count, dtype=torch.float64)
            for block, (_, o, d) in zip(blocks, choice, strict=True):
                at = torch.tensor(block.at)
                origin[:, at] = o
                directions[at.unsqueeze(-1), at] = d
            made.append((any(upper for upper, _, _ in choice), origin, directions))
        made.sort(key=lambda face: face[0])
        lower = sum(not upper for upper, _, _ in made)
        straight = all(len(block.at) == 1 for block in blocks)
        return cls(blocks, torch.stack([o for _, o, _ in made]), torch.stack([d for _, _, d in made]), lower, straight)

    def channels(self, channel: Tensor) -> "Faces":
        """The same of chosen channels (P,), again and again where they repeat."""
        blocks = tuple(Block(block.at, block.low[channel], block.high[channel]) for block in self.blocks)
        return replace(self, blocks=blocks, origin=self.origin[:, channel])

    def outside(self, z: Tensor) -> Tensor:
        """Where z (..., C, L) lies outside the polytope, (..., C)."""
        return self.below(z) | self.beyond(z)

    def below(self, z: Tensor) -> Tensor:
        """Where z (..., C, L) leaves the polytope through its lower ends, (..., C)."""
        out = torch.zeros(z.shape[:-1], dtype=torch.bool)
        for block in self.blocks:
            for i in block.at:
                out |= z[..., i] < block.low
        return out

    def beyond(self, z: Tensor) -> Tensor:
        """Where z (..., C, L) leaves it through its upper ends, (..., C)."""
        out = torch.zeros(z.shape[:-1], dtype=torch.bool)
        for block in self.blocks:
            total = z[..., block.at[0]] if len(block.at) == 1 else z[..., block.at[0]] + z[..., block.at[1]]
            out |= total > block.high * (1 + 1e-12)
        return out


def solve_faces(faces: Faces, gram: Tensor, right: Tensor, *, ends: bool = True) -> tuple[Tensor, Tensor]:
    """The minimum z (..., C, L) and the directions (..., C, L, L) of its face, for G (..., C, L, L), r (..., C, L).

    Without the polytope's ends it is that of all space, whose value none in the polytope is below.
    """
    shape = torch.broadcast_tensors(gram[..., 0], right)[0].shape  # broadcast_shapes would import half of torch
    channels, count = shape[-2:]
    gram = gram.expand(*shape, count).reshape(-1, channels, count, count)
    right = right.expand(shape).reshape(-1, channels, count)
    inside = faces.origin[0]  # of the first face, on which every unknown is free
    z = inside + solve_definite(gram, right - times(gram, inside))
    face = torch.zeros(z.shape[:-1], dtype=torch.long)
    for leaves, among in ((faces.below, faces.lower), (faces.beyond, len(faces.origin))) if ends else ():
        row, channel = leaves(z).nonzero(as_tuple=True)
        if len(row):
            systems = gram[row, channel].unsqueeze(0), right[row, channel].unsqueeze(0)
            again, picked = _best(faces.channels(channel), among, *systems)
            z[row, channel], face[row, channel] = again[0], picked[0]
    return z.reshape(shape), faces.directions[face].reshape(*shape, count)


def _best(faces: Faces, among: int, gram: Tensor, right: Tensor) -> tuple[Tensor, Tensor]:
    """The best z (B, C, L) of those on so many of the first faces that leave no end of theirs, and its face (B, C)."""
    start = faces.origin[:among].unsqueeze(0)  # (1, F, C, L)
    d = faces.directions[:among].unsqueeze(1)  # (F, 1, L, L)
    g, r = gram.unsqueeze(1), right.unsqueeze(1)  # (B, 1, C, L, L), (B, 1, C, L)
    offset = bool(start.any())
    slope = r - times(g, start) if offset else r
    if faces.along_axes or among <= faces.lower:  # no products of tiny matrices, which cost a call each
        e = d.diagonal(dim1=-2, dim2=-1)
        system, wanted = g * e.unsqueeze(-1) * e.unsqueeze(-2), slope * e
        t = step = solve_definite(system, wanted)
    else:
        system, wanted = d.mT @ g @ d, times(d.mT, slope)
        t = solve_definite(system, wanted)
        step = times(d, t)
    z = start + step  # (B, F, C, L)
    wrong = faces.below(z)
    value = -dot(t, wanted)
    if offset:
        value -= dot(start, slope + r)
    if among > faces.lower:
        wrong |= faces.beyond(z)
    face = value.masked_fill_(wrong, torch.inf).argmin(1)  # (B, C)
    return z.gather(1, face[:, None, :, None].expand(-1, 1, -1, z.shape[-1])).squeeze(1), face


def dot(a: Tensor, b: Tensor) -> Tensor:
    """The sums of a b over a last dimension of few (..., L), (...), by element: a reduction over few is slow."""
    total = a[..., 0] * b[..., 0]
    for i in range(1, a.shape[-1]):
        total = torch.addcmul(total, a[..., i], b[..., i])
    return total


def times(matrix: Tensor, vector: Tensor) -> Tensor:
    """The products (..., K) of small matrices (..., K, L) and vectors (..., L), by element as well."""
    total = matrix[..., 0] * vector[..., :1]
    for i in range(1, matrix.shape[-1]):
        total = torch.addcmul(total, matrix[..., i], vector[..., i : i + 1])
    return total


def solve_definite(matrix: Tensor, right: Tensor) -> Tensor:
    """The solutions of small positive semidefinite systems (..., L, L), (..., L), 0 where a diagonal is 0.

    Cholesky's elimination of the scaled matrix, written out by element so that all systems are eliminated at once:
    LAPACK would be called for each.
    """
    count = matrix.shape[-1]
    diagonal = matrix.diagonal(dim1=-2, dim2=-1)
    seen = diagonal > 0
    scaling = torch.where(seen, diagonal.clamp(min=1e-300).rsqrt(), 0.0)
    scale, d = list(scaling.unbind(-1)), list(torch.where(seen, 1 + _RIDGE, 1.0).unbind(-1))
    b = list((right * scaling).unbind(-1))
    m = [[matrix[..., i, j] * scale[i] * scale[j] for j in range(i)] for i in range(count)]
    for j in range(count):
        pivot = d[j].clamp(min=_RIDGE)
        for i in range(j + 1, count):
            factor = m[i][j] / pivot
            for k in range(j + 1, i):
                m[i][k] = m[i][k] - factor * m[k][j]
            d[i] = d[i] - factor * m[i][j]
            b[i] = b[i] - factor * b[j]
    for i in reversed(range(count)):
        for k in range(i + 1, count):
            b[i] = b[i] - m[k][i] * b[k]
        b[i] = b[i] / d[i].clamp(min=_RIDGE)
    return torch.stack(b, dim=-1) * scaling


def solve_box(gram: Tensor, right: Tensor, low: Tensor, high: Tensor) -> tuple[Tensor, Tensor]:
    """The minimum z (..., D) in a box, and which unknowns are free there (..., D), for G (..., D, D), r (..., D)."""
    diagonal = gram.diagonal(dim1=-2, dim2=-1)
    scale = torch.where(diagonal > 0, diagonal.clamp(min=1e-300).rsqrt(), 1.0)
    gram = scale.unsqueeze(-1) * gram * scale.unsqueeze(-2)
    ends = low, high
    right, low, high = right * scale, low / scale, high / scale
    small = 1e-13 * right.abs().amax(-1, keepdim=True)
    side = torch.zeros_like(right)  # -1 on the low end, 1 on the high one
    z = low
    for step in range(_EXCHANGES * (1 + right.shape[-1])):
        free = side == 0
        fixed = torch.where(side < 0, low, torch.where(side > 0, high, 0.0))
        both = free.unsqueeze(-1) & free.unsqueeze(-2)
        system = torch.where(both, gram, 0.0) + torch.diag_embed(torch.where(free, _RIDGE, 1.0))
        wanted = torch.where(free, right - (gram @ fixed.unsqueeze(-1)).squeeze(-1), fixed)
        z = torch.linalg.solve_ex(system, wanted.unsqueeze(-1))[0].squeeze(-1)
        slope = (gram @ z.unsqueeze(-1)).squeeze(-1) - right
        wrong = torch.where(free, (z < low) | (z > high), side * slope > small)
        if not bool(wrong.any()):
            break
        if step >= _EXCHANGES:  # Murty's rule: only the last wrong one, which cannot cycle
            last = wrong.shape[-1] - 1 - wrong.flip(-1).int().argmax(-1, keepdim=True)
            wrong &= torch.zeros_like(wrong).scatter_(-1, last, value=True)
        side = torch.where(wrong, torch.where(free, torch.where(z < low, -1.0, 1.0), 0.0), side)
    inside = torch.minimum(torch.maximum(z * scale, ends[0]), ends[1])
    return torch.where(side < 0, ends[0], torch.where(side > 0, ends[1], inside)), side == 0
