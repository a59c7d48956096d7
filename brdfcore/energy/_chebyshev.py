"""Chebyshev interpolation on [-1, 1]: nodes, coefficients, polynomials, and how many of them a tolerance needs.

    x_j = cos(pi j / m), j = 0..m;   v(x) = sum over k <= m of c_k T_k(x)

Source: Trefethen 2013, "Approximation Theory and Approximation Practice", chapters 2-4.
"""

import functools
import math
from collections.abc import Sequence

import torch
from torch import Tensor

PRODUCTS = 2**22  # numbers that an interpolation of many points holds at a time


@functools.cache
def nodes(count: int) -> Tensor:
    """The extreme points of T_m, m = count - 1 >= 1, from 1 down to -1, (count,); exactly symmetric."""
    m = count - 1
    return torch.sin(math.pi / (2 * m) * (m - 2 * torch.arange(count, dtype=torch.float64)))


@functools.cache
def _transform(count: int) -> Tensor:
    """The matrix from values at the nodes to coefficients, (count, count)."""
    m = count - 1
    j = torch.arange(count)
    # the product j k is reduced modulo the period first, so that no digits are lost
    matrix = torch.cos(math.pi / m * (j[:, None] * j % (2 * m)).double()) * (2 / m)
    matrix[:, [0, m]] /= 2
    matrix[[0, m]] /= 2
    return matrix


def coefficients(values: Tensor, axes: int | None = None) -> Tensor:
    """The coefficients of values at the nodes along each of the first `axes` axes (of all, if None), same shape."""
    for axis in range(values.ndim if axes is None else axes):
        turned = values.movedim(axis, 0)
        values = torch.tensordot(_transform(len(turned)), turned, dims=1).movedim(0, axis)
    return values


def polynomials(x: Tensor, count: int) -> Tensor:
    """T_0 to T_(count-1) at x (...), on a last axis (..., count); differentiable everywhere."""
    found = [torch.ones_like(x), x]
    while len(found) < count:
        found.append(2 * x * found[-1] - found[-2])
    return torch.stack(found[:count], dim=-1)


def needed(coefficient: Tensor, tolerance: float) -> int:
    """How many of the coefficients (n, ...) are needed if, in every column, the rest may sum to the tolerance."""
    tail = coefficient.abs().flatten(1).flip(0).cumsum(0).amax(1)
    return int(len(tail) - (tail <= tolerance).sum())


def contract(coefficient: Tensor, x: list[Tensor]) -> Tensor:
    """The polynomial (..., C) of coefficients (n_1, ..., n_d, C) at places x in [-1, 1] on each axis, which broadcast.

    Axes at a single place go first, since they make the table smaller for all the others.
    """
    spread = torch.broadcast_shapes(*(place.shape for place in x))
    order = sorted(range(len(x)), key=lambda k: x[k].ndim > 0)
    left: Tensor = coefficient.permute(*order, len(x))
    rows = []
    for k in order:
        if x[k].ndim == 0:
            left = torch.tensordot(polynomials(x[k], len(left)), left, dims=1)
        else:
            rows.append(x[k].expand(spread).flatten())
    if not rows:
        return left
    step = max(1, PRODUCTS * len(left) // left.numel())
    blocks = zip(*(row.split(step) for row in rows), strict=True)
    found = [_at_rows(left, block) for block in blocks]
    return torch.cat(found).reshape(*spread, coefficient.shape[-1])


def _at_rows(left: Tensor, places: Sequence[Tensor]) -> Tensor:
    """The polynomial (Q, C) at Q rows of places on each of the axes that are left."""
    first, *others = (polynomials(x, count) for x, count in zip(places, left.shape, strict=False))
    found: Tensor = torch.tensordot(first, left, dims=1)
    for basis in others:
        found = torch.einsum("qn,qn...->q...", basis, found)
    return found
