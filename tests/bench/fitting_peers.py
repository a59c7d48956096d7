"""What others would fit with: a material in numpy, for scipy's least_squares and lmfit, as fast as numpy allows."""

import time
from collections.abc import Callable

import numpy as np
import scipy.optimize

import brdfcore as bc


class NumpyMaterial:
    """lambert + lobes of Ward's bounded kind or Kurt's, isotropic or not: residuals c (f - y) and their Jacobian.

    x holds kd (C), then for each lobe its ks (C), for Kurt's f0, the widths, and for Kurt's alpha. A model function as
    users write it is one of directions and parameters; `tuned`, what the directions decide is computed once.
    """

    def __init__(self, samples: bc.Samples, lobe: str, lobes: int, widths: int, *, tuned: bool = False) -> None:
        self.wi, self.wo = samples.wi.numpy(), samples.wo.numpy()
        self.kurt, self.tuned = lobe == "kurt", tuned
        self.y = samples.values.numpy()
        self._prepare()
        self.channels, self.lobes, self.widths = self.y.shape[1], lobes, widths
        self.each = self.channels + widths + 2 * self.kurt
        size = self.channels + lobes * self.each
        self.low, self.high = np.zeros(size), np.ones(size)
        self.width_at = []
        for lobe_ in range(lobes):
            begin = self.channels + lobe_ * self.each + self.channels + self.kurt
            self.low[begin : begin + widths], self.high[begin : begin + widths] = 1e-4, 10
            self.width_at += range(begin, begin + widths)

    def _prepare(self) -> None:
        """What the directions decide."""
        h = self.wi + self.wo
        self.p2, self.q2 = (h[:, 0] / h[:, 2]) ** 2, (h[:, 1] / h[:, 2]) ** 2
        e2 = self.p2 + self.q2
        ci, co = self.wi[:, 2], self.wo[:, 2]
        if self.kurt:
            cosine = 0.5 * np.sqrt((h**2).sum(1))
            self.front = (1 + e2) ** 2 / (4 * np.pi * cosine)
            self.s = (1 - cosine) ** 5
            self.log = np.log(ci * co)
        else:
            self.front = (1 + e2) / (np.pi * h[:, 2] ** 2)
        self.c = ci[:, None]
        self.cy = self.c * self.y

    def start(self, widths: list[float], reflectance: float = 0.2) -> np.ndarray:
        """A start with these widths of the lobes."""
        x = np.full(len(self.low), reflectance)
        for lobe in range(self.lobes):
            begin = self.channels + lobe * self.each + self.channels
            if self.kurt:
                x[begin], begin = 0.04, begin + 1
                x[begin + self.widths] = 0.1
            x[begin : begin + self.widths] = widths[lobe]
        return x

    def random_start(self, random: np.random.Generator) -> np.ndarray:
        """Reflectances from [0, 1], widths from .005 to 1.5 by their logarithm."""
        x = random.uniform(0.01, 0.99, len(self.low))
        x[self.width_at] = np.exp(random.uniform(np.log(0.005), np.log(1.5), len(self.width_at)))
        return x

    def _lobe(self, x: np.ndarray, lobe: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        own = x[self.channels + lobe * self.each :][: self.each]
        ks, rest = own[: self.channels], own[self.channels + self.kurt :]
        wx, wy = rest[0], rest[self.widths - 1]
        value = self.front * np.exp(-(self.p2 / wx**2 + self.q2 / wy**2)) / (wx * wy)
        if self.kurt:
            value = value * np.exp(-rest[self.widths] * self.log)
        f0 = own[self.channels] if self.kurt else 1.0
        fresnel = f0 + (1 - f0) * self.s if self.kurt else np.ones(1)
        return ks, value, fresnel, rest[: self.widths]

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """The residuals c (f - y), flat."""
        if not self.tuned:
            self._prepare()
        f = np.broadcast_to(x[: self.channels] / np.pi, self.y.shape)
        for lobe in range(self.lobes):
            ks, value, fresnel, _ = self._lobe(x, lobe)
            f = f + (value * fresnel)[:, None] * ks
        return (self.c * f - self.cy).ravel()

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Its derivatives."""
        if not self.tuned:
            self._prepare()
        out = np.zeros((*self.y.shape, len(x)))
        channel = np.arange(self.channels)
        out[:, channel, channel] = self.c / np.pi
        for lobe in range(self.lobes):
            ks, value, fresnel, widths = self._lobe(x, lobe)
            at = self.channels + lobe * self.each
            out[:, channel, at + channel] = self.c * (value * fresnel)[:, None]
            at += self.channels
            colour = self.c * (value * fresnel)[:, None] * ks
            if self.kurt:
                out[:, :, at] = self.c * (value * (1 - self.s))[:, None] * ks
                at += 1
            exponents = [self.p2 + self.q2] if self.widths == 1 else [self.p2, self.q2]
            for i, (width, p2) in enumerate(zip(widths, exponents, strict=True)):
                out[:, :, at + i] = colour * (2 * p2 / width**3 - (3 - self.widths) / width)[:, None]
            if self.kurt:
                out[:, :, at + self.widths] = -colour * self.log[:, None]
        return out.reshape(-1, len(x))

    def trf(self, x: np.ndarray, *, analytic: bool, limit: int | None = None) -> tuple[float, int]:
        """The sum of squares where scipy's trust-region-reflective method ends, and its evaluations."""
        jac = self.jacobian if analytic else "2-point"
        fit = scipy.optimize.least_squares(self.residuals, x, jac, (self.low, self.high), x_scale="jac", max_nfev=limit)
        return 2 * fit.cost, fit.nfev

    def lmfit(self, x: np.ndarray) -> float:
        """The sum of squares where lmfit's default method (MINPACK, ends by a transform) ends."""
        import lmfit

        parameters = lmfit.Parameters()
        for i, (value, low, high) in enumerate(zip(x, self.low, self.high, strict=True)):
            parameters.add(f"x{i}", value=value, min=low, max=high)

        def residuals(p: lmfit.Parameters) -> np.ndarray:
            return self.residuals(np.array([p[f"x{i}"].value for i in range(len(x))]))

        return float(np.square(lmfit.minimize(residuals, parameters).residual).sum())


def seconds(call: Callable[[], object]) -> float:
    """The processor time of one call [s]."""
    begun = time.process_time()
    call()
    return time.process_time() - begun


def by_turns(calls: dict[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """The median processor time of each call [s]; each round calls all, so that a busy machine slows all alike."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(rounds):
        for name, call in calls.items():
            times[name].append(seconds(call))
    return {name: float(np.median(each)) for name, each in times.items()}
