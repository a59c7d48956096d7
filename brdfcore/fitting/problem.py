"""A fit as numbers: residuals of vectors of raw values, and their exact normal equations.

A value a channel reaches only its own channel's residuals, so a derivative is one column a parameter name, and the
normal equations are summed from those into the (D, D) matrix: 31 channels cost what one name costs. All is float64,
summed in chunks, and batched over rows: starts, and materials that share their directions.
"""

import functools
from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor

from ..formats.samples import Samples
from ..parameters import Values
from .columns import Columns, Mix
from .data import Data
from .losses import Loss, Scales
from .plan import Plan
from .robust import ROBUST, softened


class Gram(NamedTuple):
    """The normal equations of S rows."""

    loss: Tensor  # (S,)
    gradient: Tensor  # (S, D), of half the loss
    matrix: Tensor  # (S, D, D), J^T J

    def pick(self, index: Tensor) -> "Gram":
        """The rows of an index."""
        return Gram(*(part[index] for part in self))


class Problem:
    """The residuals of a plan over samples under a loss, as functions of rows of raw free values x (S, D).

    `which` (S,) names the material of each row; without it all rows belong to the only one. A robust plan needs the
    scale (M,) of its residuals.
    """

    def __init__(
        self,
        plan: Plan,
        samples: Samples | Sequence[Samples],
        loss: Loss,
        scales: Scales | None = None,
        robust_scale: Tensor | None = None,
        data: Data | None = None,
    ) -> None:
        self.plan = plan
        self.loss_kind = loss
        self.robust_scale = robust_scale
        several = [samples] if isinstance(samples, Samples) else list(samples)
        self.data = data or Data.of(several, plan.form.needs, loss, scales)
        self.channels = self.data.y.shape[1]
        self.keys = plan.free
        sizes = [plan.start[key].numel() for key in self.keys]
        begins = [sum(sizes[:i]) for i in range(len(sizes))]
        self.slices = {key: slice(b, b + n) for key, b, n in zip(self.keys, begins, sizes, strict=True)}
        self.size = sum(sizes)
        self.index = torch.zeros(self.channels, len(sizes), dtype=torch.long)  # (C, P): where a name's value is in x
        for p, (b, n) in enumerate(zip(begins, sizes, strict=True)):
            self.index[:, p] = torch.arange(b, b + n)
        self.logarithmic = torch.tensor([plan.form.parameters[key].scale == "log" for key in self.keys])
        self.low, self.high = self._raw_bounds()
        self.columns = Columns(plan.form, plan.start, self.keys, self.data.slice(0, 2).g)
        self.evaluations = 0

    def _raw_bounds(self) -> tuple[Tensor, Tensor]:
        sides: list[list[Tensor]] = [[], []]
        for key in self.keys:
            parameter = self.plan.form.parameters[key]
            for side, natural in zip(sides, self.plan.limits(key), strict=True):
                side.append(parameter.to_raw(natural).reshape(-1))
        empty = torch.zeros(0, dtype=torch.float64)
        low, high = (torch.cat([empty, *side]) for side in sides)
        return low, high

    @property
    def materials(self) -> int:
        """How many materials the data are of, M."""
        return len(self.data.y)

    @property
    def linear(self) -> bool:
        """Whether the residuals are linear in f."""
        return self.plan.robust is None and self.loss_kind.factor is not None

    @functools.cached_property
    def squares(self) -> Tensor:
        """The sum of squares of the weighted c y, (M,): the unit in which losses of any data are of order one."""
        return (self.data.root_weight * self.data.c * self.data.y).square().sum((1, 2))

    def pack(self, values: Values) -> Tensor:
        """The raw vector (D,) of the free values, put into the bounds."""
        parameters = self.plan.form.parameters
        raw = [parameters[key].to_raw(values[key]).reshape(-1) for key in self.keys]
        x = torch.cat(raw) if raw else torch.zeros(0, dtype=torch.float64)
        return x.clamp(self.low, self.high)

    def unpack(self, x: Tensor) -> dict[str, Tensor]:
        """All natural values, the fixed ones included, from the raw vector (D,)."""
        values = {key: self.plan.start[key] for key in self.plan.fixed}
        for key, at in self.slices.items():
            raw = x[at].reshape(self.plan.start[key].shape)
            values[key] = self.plan.form.parameters[key].from_raw(raw)
        return values

    def natural(self, x: Tensor) -> dict[str, Tensor]:
        """All natural values of rows x (S, D), each (S, 1, 1) or (S, 1, C), the fixed ones () or (C,)."""
        values = {key: self.plan.start[key] for key in self.plan.fixed}
        for key, at in self.slices.items():
            values[key] = self.plan.form.parameters[key].from_raw(x[:, at].unsqueeze(1))
        return values

    def chain(self, x: Tensor) -> Tensor:
        """The derivatives of the natural values by the raw ones, (S, C, P)."""
        raw = x[:, self.index]
        return torch.where(self.logarithmic, torch.exp(torch.where(self.logarithmic, raw, 0.0)), 1.0)

    def mix(self, x: Tensor) -> Mix:
        """How the columns make value and derivatives at x (S, D)."""
        natural, shape = self.natural(x), (len(x), 1, self.channels)
        coefficients = self.columns.coefficients(natural, shape).squeeze(1)
        slopes = self.columns.coefficient_slopes(natural, shape).squeeze(1)
        return self.columns.mix(coefficients, slopes, self.chain(x))

    def f(self, x: Tensor, data: Data) -> Tensor:
        """The model's BRDF [1/sr], (S, C, N)."""
        natural = self.natural(x)
        columns = self.columns.values(natural, data.g, len(x), self.channels)
        return _mixed(self.columns.coefficients(natural, (len(x), 1, self.channels)).squeeze(1), columns)

    def residuals(self, f: Tensor, data: Data, which: Tensor | None) -> tuple[Tensor, Tensor, Tensor]:
        """For f (S, C, N): what adds up to the loss, residuals as Gauss-Newton sees them, and their slopes by f."""
        if self.loss_kind.factor is not None:
            slope = (data.root_weight * self.loss_kind.factor(data.y, data.c, data.scales)).expand_as(f)
            r = slope * (f - data.y)
        else:
            with torch.enable_grad():
                leaf = f.detach().requires_grad_()
                r = data.root_weight * self.loss_kind.difference(leaf, data.y, data.c, data.scales)
                (slope,) = torch.autograd.grad(r.sum(), leaf)
            r = r.detach()
        if self.plan.robust is None or self.robust_scale is None:
            return r.square(), r, slope
        scale = (self.robust_scale if which is None else self.robust_scale[which]).reshape(-1, 1, 1)
        rho, r, root = softened(ROBUST[self.plan.robust], scale * data.counted, r)  # w s^2 rho(r^2 / (w s^2)) for w r^2
        return rho, r, slope * root

    def loss(self, x: Tensor, which: Tensor | None = None) -> Tensor:
        """The sum of squares, or of what a robust form makes of them, of each row, (S,)."""
        self.evaluations += len(x)
        total = torch.zeros(len(x), dtype=torch.float64)
        for piece in self.data.chunks(len(x)):
            data = piece if which is None else piece.rows(which)
            total += self.residuals(self.f(x, data), data, which)[0].sum((1, 2))
        return total

    def jacobian(self, x: Tensor, data: Data, which: Tensor | None = None) -> tuple[Tensor, Tensor, Tensor]:
        """Residuals (S, C, N), their derivatives (S, C, P, N), one column a parameter name, and their slopes by f."""
        columns = self.columns.all(self.natural(x), data.g, len(x), self.channels)
        mix = self.mix(x)
        _, r, slope = self.residuals(_mixed(mix.value, columns), data, which)
        return r, slope.unsqueeze(2) * (mix.slopes.transpose(2, 3) @ columns), slope

    def gram(self, x: Tensor, which: Tensor | None = None) -> Gram:
        """The normal equations at each row."""
        self.evaluations += len(x)
        mix = self.mix(x)
        starts, channels, names = len(x), self.channels, len(self.keys)
        loss = torch.zeros(starts, dtype=torch.float64)
        gradient = torch.zeros(starts, channels, names, dtype=torch.float64)
        matrix = torch.zeros(starts, channels, names, names, dtype=torch.float64)
        natural = self.natural(x)
        for at, _, piece in self.data.blocks(starts):
            own = None if which is None else which[at]
            data = piece if own is None else piece.rows(own)
            columns = self.columns.all(rows_of(natural, at), data.g, at.stop - at.start, channels)
            slopes = mix.slopes[at]
            rho, r, slope = self.residuals(_mixed(mix.value[at], columns), data, own)
            loss[at] += rho.sum((1, 2))
            if self.linear and columns.shape[1] == 1:
                factor = linear_factor(self.loss_kind, data)
                if factor.shape[1] == 1:  # one product of columns serves all channels
                    weighed = columns * factor.unsqueeze(2)
                    matrix[at] += slopes.mT @ (weighed @ weighed.mT) @ slopes
                    right = weighed[:, 0] @ r.mT  # (S, Q, C)
                    gradient[at] += (slopes.mT @ right.mT.unsqueeze(-1)).squeeze(-1)
                    continue
            rows = slope.unsqueeze(2) * (slopes.mT @ columns)  # (S, C, P, N)
            gradient[at] += (rows @ r.unsqueeze(-1)).squeeze(-1)
            matrix[at] += rows @ rows.mT
        return Gram(loss, self.scatter_vector(gradient), self.scatter_matrix(matrix))

    def gradient(self, x: Tensor, which: Tensor | None = None) -> tuple[Tensor, Tensor]:
        """The loss (S,) of each row and the gradient (S, D) of half of it, as in its normal equations.

        Of one channel no product of matrices is asked for: threads that LAPACK calls in cost more than few samples do.
        """
        self.evaluations += len(x)
        mix, natural, starts = self.mix(x), self.natural(x), len(x)
        loss = torch.zeros(starts, dtype=torch.float64)
        right = torch.zeros_like(mix.value)  # (S, C, Q)
        for at, _, piece in self.data.blocks(starts):
            own = None if which is None else which[at]
            data = piece if own is None else piece.rows(own)
            columns = self.columns.all(rows_of(natural, at), data.g, at.stop - at.start, self.channels)
            value = mix.value[at]
            if self.channels == 1:
                f = (value.unsqueeze(-1) * columns).sum(2)
                rho, r, slope = self.residuals(f, data, own)
                right[at] += (columns * (slope * r).unsqueeze(2)).sum(-1)
            else:
                rho, r, slope = self.residuals(_mixed(value, columns), data, own)
                right[at] += (columns @ (slope * r).unsqueeze(-1)).squeeze(-1)
            loss[at] += rho.sum((1, 2))
        return loss, self.scatter_vector((mix.slopes * right.unsqueeze(-1)).sum(-2))

    def scatter_vector(self, by_channel: Tensor) -> Tensor:
        """(S, C, P) by channel and name, summed into (S, D)."""
        flat = self.index.reshape(-1)
        out = torch.zeros(len(by_channel), self.size, dtype=torch.float64)
        return out.index_add_(1, flat, by_channel.flatten(1))

    def scatter_matrix(self, by_channel: Tensor) -> Tensor:
        """(S, C, P, P) by channel and names, summed into (S, D, D)."""
        flat = (self.index.unsqueeze(-1) * self.size + self.index.unsqueeze(-2)).reshape(-1)
        out = torch.zeros(len(by_channel), self.size * self.size, dtype=torch.float64)
        out.index_add_(1, flat, by_channel.flatten(1))
        return out.reshape(-1, self.size, self.size)

    def held(self, x: Tensor, gradient: Tensor) -> Tensor:
        """Which values lie on an end of their box with the descent pointing out of it, (S, D)."""
        return ((x <= self.low) & (gradient > 0)) | ((x >= self.high) & (gradient < 0))


def rows_of(natural: Values, at: slice) -> dict[str, Tensor]:
    """Some of the rows of natural values, of those that differ by row."""
    return {key: value[at] if value.ndim == 3 else value for key, value in natural.items()}


def linear_factor(loss: Loss, data: Data) -> Tensor:
    """What multiplies f - y in the residuals of a loss that is linear in f, (M, C, N) or broadcasting to it."""
    if loss.factor is None:
        raise TypeError(f"the residuals of {loss.name} are not linear in f")
    return data.root_weight * loss.factor(data.y, data.c, data.scales)


def _mixed(coefficients: Tensor, columns: Tensor) -> Tensor:
    """Columns (S, W, Q, N) mixed by coefficients (S, C, Q), of the first columns where those are fewer: (S, C, N)."""
    if columns.shape[1] == 1:
        return coefficients @ columns[:, 0, : coefficients.shape[-1]]
    return (coefficients.unsqueeze(2) @ columns[:, :, : coefficients.shape[-1]]).squeeze(2)
