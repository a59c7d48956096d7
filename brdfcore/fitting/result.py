"""A fit's result: values with intervals, errors under every loss, a status in words, and what it cost."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from torch import Tensor

from ..formats.samples import Samples
from ..models.form import Form
from ..models.material import Material
from .rung import Rung, table


@dataclass(frozen=True)
class Cost:
    """What the fit cost."""

    seconds: float
    evaluations: int  # of the residuals of one start
    iterations: int
    starts: int
    optimizer: str


@dataclass(frozen=True, eq=False)
class Fit:
    """What `bc.fit` returns.

    form, values, samples: what was fitted, the best values, stored parameters only, and to what.
    parameters, standard_errors: key -> () or (C,); intervals: key -> (2,) or (C, 2), 95 %. NaN stands where there is no
    number to give: in an interval for a value that was fixed or lies on an end of its box, and everywhere for one
    that the data leave undetermined. `objective` is the loss that was minimised: chi-square where the samples' sigma
    weighed it, else the error of that name. `status` is "converged" or "stopped_early", `message` says more.
    """

    form: Form
    values: dict[str, Tensor]
    samples: Samples
    parameters: dict[str, Tensor]
    standard_errors: dict[str, Tensor]
    intervals: dict[str, Tensor]
    errors: dict[str, float]
    loss: str
    objective: float
    status: str
    message: str
    undetermined: tuple[str, ...]
    choices: tuple[str, ...]
    fixed: tuple[str, ...]
    gray: tuple[str, ...]
    per_channel: tuple[str, ...]
    chi_square: tuple[float, int] | None  # with its degrees of freedom, where the samples' sigma is known
    cost: Cost
    channels: tuple[str, ...]
    provenance: dict[str, str | int]
    ladder: tuple[Rung, ...] = ()  # the materials that were tried, where the fit chose among several

    @cached_property
    def material(self) -> Material:
        """The fitted material."""
        return Material(self.form, self.values)

    @property
    def model(self) -> str:
        """The model that was fitted, its options decided, without values."""
        return self.form.text()

    def units(self) -> dict[str, str]:
        """What each parameter is, with its unit."""
        return {key: parameter.description for key, parameter in self.form.all_parameters.items()}

    def to_dict(self) -> dict[str, Any]:
        """The result as JSON-able data, null where there is no number."""
        result = {
            "model": self.model,
            "material_text": str(self.material),
            "material": self.material.to_json(),
            "loss": self.loss,
            "objective": _number(self.objective),
            "status": self.status,
            "message": self.message,
            "parameters": {key: _numbers(value) for key, value in self.parameters.items()},
            "standard_errors": {key: _numbers(value) for key, value in self.standard_errors.items()},
            "intervals": {key: _intervals(value) for key, value in self.intervals.items()},
            "units": self.units(),
            "errors": {key: _number(value) for key, value in self.errors.items()},
            "undetermined": list(self.undetermined),
            "choices": list(self.choices),
            "fixed": list(self.fixed),
            "gray": list(self.gray),
            "per_channel": list(self.per_channel),
            "chi_square": None if self.chi_square is None else list(self.chi_square),
            "cost": vars(self.cost).copy(),
            "channels": list(self.channels),
            "data": self.samples.report(),
            "provenance": dict(self.provenance),
            "ladder": [rung.to_dict() for rung in self.ladder],
        }
        return {**result, "report": _report(result)}

    def report(self) -> str:
        """The result as plain text, one line a value."""
        return str(self.to_dict()["report"])


def _report(result: dict[str, Any]) -> str:
    lines = [result["model"], f"{result['status'].replace('_', ' ')}: {result['message']}", ""]
    lines.append(f"{'parameter':<32}{'value':>12}  {'95 % interval':<27}what it is")
    for key, value in result["parameters"].items():
        without = "fixed" if key in result["fixed"] else "none"
        intervals, what = result["intervals"][key], result["units"].get(key, "")
        if isinstance(value, list):
            names = [f"{key}[{name}]" for name in result["channels"]]
            lines.append(_row(names[0], value[0], intervals[0], without, what))
            rows = list(zip(names, value, intervals, strict=True))[1:]
            lines += [_row(name, v, interval, without, "") for name, v, interval in rows]
        else:
            lines.append(_row(key, value, intervals, without, what))
    lines += ["", "errors: " + ", ".join(f"{name} {value:.6g}" for name, value in result["errors"].items())]
    if result["chi_square"] is not None:
        lines.append("chi-square {:.6g} for {} degrees of freedom".format(*result["chi_square"]))
    if result["undetermined"]:
        lines.append("not determined by the data: " + ", ".join(result["undetermined"]))
    lines += table(result["ladder"])
    lines += result["choices"]
    lines += [f"left out: {m['count']} samples, {m['reason']}" for m in result["data"].get("masked", [])]
    cost, made = result["cost"], result["provenance"]
    lines.append(
        f"{cost['seconds']:.2f} s, {cost['evaluations']} evaluations, {cost['iterations']} iterations, "
        f"{cost['starts']} starts, {cost['optimizer']}"
    )
    lines.append(f"brdfcore {made['version']}, torch {made['torch']}, seed {made['seed']}, input {made['input']}")
    return "\n".join(lines)


def _row(key: str, value: float | None, interval: list[float] | None, without: str, what: str) -> str:
    number = "none" if value is None else f"{value:.6g}"
    span = without if interval is None else f"[{interval[0]:.6g}, {interval[1]:.6g}]"
    return f"{key:<32}{number:>12}  {span:<27}{what}".rstrip()


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _numbers(value: Tensor) -> Any:
    return _number(value.item()) if value.ndim == 0 else [_number(v) for v in value.tolist()]


def _intervals(value: Tensor) -> Any:
    if value.ndim == 1:
        return value.tolist() if bool(value.isfinite().all()) else None
    return [_intervals(row) for row in value]
