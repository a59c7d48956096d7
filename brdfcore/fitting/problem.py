"""A fit as numbers: residuals of a vector of raw values, and their exact derivatives.

A value a channel reaches only its own channel's residuals, so the Jacobian is kept as one column a parameter name,
(N, C, P), and the normal equations are summed from it into the (D, D) matrix: 31 channels cost what one name costs.
All is float64, summed in chunks, and batched over starts.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor
from torch.func import jvp, vmap

from ..formats.samples import Samples
from ..geometry import Geometry, geometry
from ..models.form import Form
from ..parameters import Values
from .losses import Loss, Scales
from .plan import Plan

_CHUNK = 4_000_000  # numbers in the largest intermediate: 32 MB


@dataclass(frozen=True)
class Data:
    """What a chunk of residuals is computed from."""

    g: Geometry
    c: Tensor  # (N, 1) cos theta_i
    y: Tensor  # (N, C)
    root_weight: Tensor  # (N, 1) or (N, C), square roots of the weights
    sigma: Tensor | None  # (N, C)

    def slice(self, begin: int, end: int) -> "Data":
        """The samples from begin to end."""
        geometry_ = Geometry(*(None if q is None else q[begin:end] for q in self.g))
        sigma = None if self.sigma is None else self.sigma[begin:end]
        return Data(geometry_, self.c[begin:end], self.y[begin:end], self.root_weight[begin:end], sigma)


class Gram(NamedTuple):
    """The normal equations of S starts."""

    loss: Tensor  # (S,)
    gradient: Tensor  # (S, D), of half the loss
    matrix: Tensor  # (S, D, D), J^T J


class Problem:
    """The residuals of a plan over samples under a loss, as a function of the raw free values x (D,)."""

    def __init__(self, plan: Plan, samples: Samples, loss: Loss, scales: Scales | None = None) -> None:
        self.plan = plan
        self.loss_kind = loss
        g = geometry(samples.wi, samples.wo, plan.form.needs)
        c = samples.wi[:, 2:]
        self.data = Data(g, c, samples.values, root_weights(samples, loss), samples.sigma)
        self.scales = scales or Scales.of(samples.values, c)
        self.keys = plan.free
        sizes = [plan.start[key].numel() for key in self.keys]
        begins = [sum(sizes[:i]) for i in range(len(sizes))]
        self.slices = {key: slice(b, b + n) for key, b, n in zip(self.keys, begins, sizes, strict=True)}
        self.size = sum(sizes)
        channels = samples.values.shape[1]
        self.index = (
            torch.stack(  # (C, P): where the value of a name for a channel stands in x
                [torch.arange(b, b + n).expand(channels) for b, n in zip(begins, sizes, strict=True)], dim=-1
            )
            if self.keys
            else torch.zeros(channels, 0, dtype=torch.long)
        )
        self.tangents = torch.zeros(len(sizes), self.size, dtype=torch.float64)
        for row, (b, n) in enumerate(zip(begins, sizes, strict=True)):
            self.tangents[row, b : b + n] = 1
        self.low, self.high = self._raw_bounds(plan.form)
        self.evaluations = 0

    @property
    def residual_count(self) -> int:
        """How many residuals there are, N C."""
        return self.data.y.numel()

    def _raw_bounds(self, form: Form) -> tuple[Tensor, Tensor]:
        ends: list[list[Tensor]] = [[], []]
        for key in self.keys:
            parameter = form.parameters[key]
            for side, natural in zip(ends, form.bounds(key, self.plan.start[key]), strict=True):
                side.append(parameter.to_raw(natural).reshape(-1))
        empty = torch.zeros(0, dtype=torch.float64)
        return (torch.cat(ends[0]), torch.cat(ends[1])) if self.keys else (empty, empty)

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

    def f(self, x: Tensor, data: Data) -> Tensor:
        """The model's BRDF [1/sr], (N, C)."""
        return self.plan.form.f(self.unpack(x), data.g).expand_as(data.y)

    def residuals(self, x: Tensor, data: Data) -> Tensor:
        """The weighted residuals (N, C) whose squares add up to the loss."""
        return data.root_weight * self.loss_kind.difference(self.f(x, data), data.y, data.c, self.scales)

    def chunks(self, numbers_a_sample: int) -> Iterator[Data]:
        """The data in pieces that keep intermediates of so many numbers a sample small."""
        count = self.data.y.shape[0]
        step = max(1, _CHUNK // max(1, numbers_a_sample))
        for begin in range(0, count, step):
            yield self.data.slice(begin, min(begin + step, count)) if step < count else self.data

    def loss(self, x: Tensor) -> Tensor:
        """The sum of squares for each of S raw vectors, (S, D) -> (S,)."""
        self.evaluations += len(x)
        total = torch.zeros(len(x), dtype=torch.float64)
        for data in self.chunks(3 * len(x) * self.data.y.shape[1]):
            total = total + vmap(lambda row, d=data: self.residuals(row, d).square().sum())(x)
        return total

    def jacobian(self, x: Tensor, data: Data) -> tuple[Tensor, Tensor]:
        """Residuals (N, C) of one raw vector and their derivatives (N, C, P), one column a parameter name."""

        def along(tangent: Tensor) -> tuple[Tensor, Tensor]:
            value, slope = jvp(lambda v: self.residuals(v, data), (x,), (tangent,))[:2]
            return value, slope

        residuals, columns = vmap(along, out_dims=(0, -1))(self.tangents)
        return residuals[0], columns

    def gram(self, x: Tensor) -> Gram:
        """The normal equations at each of S raw vectors (S, D)."""
        self.evaluations += len(x)
        starts, channels, names = len(x), self.data.y.shape[1], len(self.keys)
        loss = torch.zeros(starts, dtype=torch.float64)
        gradient = torch.zeros(starts, channels, names, dtype=torch.float64)
        matrix = torch.zeros(starts, channels, names, names, dtype=torch.float64)
        for data in self.chunks(starts * channels * (names + 3)):
            residuals, columns = vmap(lambda row, d=data: self.jacobian(row, d))(x)
            by_channel = columns.permute(0, 2, 3, 1)  # (S, C, P, N)
            loss += residuals.square().sum((1, 2))
            gradient += (by_channel @ residuals.permute(0, 2, 1).unsqueeze(-1)).squeeze(-1)
            matrix += by_channel @ by_channel.transpose(-1, -2)
        return Gram(loss, self.scatter_vector(gradient), self.scatter_matrix(matrix))

    def scatter_vector(self, by_channel: Tensor) -> Tensor:
        """(S, C, P) by channel and name, summed into (S, D)."""
        flat = self.index.reshape(-1)
        out = torch.zeros(len(by_channel), self.size, dtype=torch.float64)
        return out.index_add_(1, flat, by_channel.reshape(len(by_channel), -1))

    def scatter_matrix(self, by_channel: Tensor) -> Tensor:
        """(S, C, P, P) by channel and names, summed into (S, D, D)."""
        flat = (self.index.unsqueeze(-1) * self.size + self.index.unsqueeze(-2)).reshape(-1)
        out = torch.zeros(len(by_channel), self.size * self.size, dtype=torch.float64)
        out.index_add_(1, flat, by_channel.reshape(len(by_channel), -1))
        return out.reshape(-1, self.size, self.size)

    def held(self, x: Tensor, gradient: Tensor) -> Tensor:
        """Which values lie on an end of their box with the descent pointing out of it, (S, D)."""
        return ((x <= self.low) & (gradient > 0)) | ((x >= self.high) & (gradient < 0))


def weights(samples: Samples, loss: Loss) -> Tensor:
    """The weights w of the loss's definition, (N, 1): the data's, else 1, times a grid cell's measure."""
    own = samples.weight if samples.weight is not None else torch.ones(len(samples), dtype=torch.float64)
    if loss.uses_cells and samples.cell is not None:
        own = own * samples.cell
    return own.unsqueeze(-1)


def root_weights(samples: Samples, loss: Loss) -> Tensor:
    """Square roots of the weights that a fit uses, (N, 1) or (N, C).

    With a known sigma and no weight, a statistical loss weighs by the inverse variance of c y: that is chi-square.
    """
    if loss.statistical and samples.sigma is not None and samples.weight is None:
        return 1 / (samples.wi[:, 2:] * samples.sigma)
    return weights(samples, loss).sqrt()
