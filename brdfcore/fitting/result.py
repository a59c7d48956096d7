"""A fit's result: values with intervals, errors under every loss, a status in words, and what it cost."""

import math
from dataclasses import dataclass
from typing import Any

from torch import Tensor

from ..models.material import Material


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

    parameters, standard_errors: key -> () or (C,); intervals: key -> (2,) or (C, 2), 95 %. NaN stands where there is no
    number to give: in an interval for a value that was fixed or lies on an end of its box, and everywhere for one
    that the data leave undetermined. `status` is "converged" or "stopped_early", `message` says more.
    """

    material: Material
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
    cost: Cost
    channels: tuple[str, ...]
    samples_report: dict[str, Any]
    provenance: dict[str, str | int]

    @property
    def model(self) -> str:
        """The model that was fitted, its options decided, without values."""
        return self.material.form.text()

    def units(self) -> dict[str, str]:
        """What each parameter is, with its unit."""
        return {key: parameter.description for key, parameter in self.material.form.all_parameters.items()}

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
            "cost": vars(self.cost).copy(),
            "channels": list(self.channels),
            "data": self.samples_report,
            "provenance": dict(self.provenance),
        }
        return {**result, "report": _report(result)}

    def report(self) -> str:
        """The result as plain text, one line a value."""
        return str(self.to_dict()["report"])


def _report(result: dict[str, Any]) -> str:
    lines = [result["model"], f"{result['status'].replace('_', ' ')}: {result['message']}", ""]
    lines.append(f"{'parameter':<32}{'value':>12}  {'95 % interval':<27}what it is")
    for key, value in result["parameters"].items():
        if isinstance(value, list):
            rows = zip(result["channels"], value, result["intervals"][key], strict=True)
            lines += [_row(f"{key}[{name}]", v, interval, "") for name, v, interval in rows]
        else:
            lines.append(_row(key, value, result["intervals"][key], result["units"][key]))
    lines += ["", "errors: " + ", ".join(f"{name} {value:.6g}" for name, value in result["errors"].items())]
    if result["undetermined"]:
        lines.append("not determined by the data: " + ", ".join(result["undetermined"]))
    lines += result["choices"]
    lines += [f"left out: {m['count']} samples, {m['reason']}" for m in result["data"].get("masked", [])]
    cost, made = result["cost"], result["provenance"]
    lines.append(
        f"{cost['seconds']:.2f} s, {cost['evaluations']} evaluations, {cost['iterations']} iterations, "
        f"{cost['starts']} starts, {cost['optimizer']}"
    )
    lines.append(f"brdfcore {made['version']}, torch {made['torch']}, seed {made['seed']}, input {made['input']}")
    return "\n".join(lines)


def _row(key: str, value: float | None, interval: list[float] | None, what: str) -> str:
    number = "none" if value is None else f"{value:.6g}"
    span = "none" if interval is None else f"[{interval[0]:.6g}, {interval[1]:.6g}]"
    return f"{key:<32}{number:>12}  {span:<27}{what}".rstrip()


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _numbers(value: Tensor) -> Any:
    return _number(value.item()) if value.ndim == 0 else [_number(v) for v in value.tolist()]


def _intervals(value: Tensor) -> Any:
    if value.ndim == 1:
        return value.tolist() if bool(value.isfinite().all()) else None
    return [_intervals(row) for row in value]
