"""A material: a Form and the numbers that go with it, as a torch module."""

import functools
from collections.abc import Mapping, Sequence
from typing import Any

import torch
from torch import Tensor, nn

from .._types import Density, Directions, Spectrum
from ..errors import ModelTextError, ParameterError, unknown_name
from ..geometry import geometry
from . import MODELS
from .form import Form, Term, build
from .text import Tie, parse

Number = float | Sequence[float] | Tensor


class Material(nn.Module):
    """A sum of models with values: evaluates, samples, and is fitted.

    f(wi, wo) [1/sr] is the BRDF without the cosine. Directions are (..., 3) of one floating dtype, which the results
    keep; wi and wo broadcast. `state_dict` holds raw values (log x for widths), `values()` and the text the natural
    ones. After a step of a torch optimiser call `project_()`, which puts every value back into its box.
    """

    def __init__(self, form: Form, values: Mapping[str, Number] | None = None) -> None:
        super().__init__()
        self.form = form
        given = {} if values is None else dict(values)
        for key in given:
            if key not in form.parameters:
                raise unknown_name("a parameter", key, form.parameters, field=key)
        raw = {term.label: nn.ParameterDict() for term in form.terms}
        for key, parameter in form.parameters.items():
            value = torch.as_tensor(given.get(key, parameter.default), dtype=torch.float64).detach()
            parameter.check(key, value)
            label, name = key.split(".")
            raw[label][name] = nn.Parameter(parameter.to_raw(value).clone())
        self.raw = nn.ModuleDict(raw)
        self._check_channels()
        self._check_ties()

    @property
    def channels(self) -> int:
        """How many channels the material has; 1 where it is gray."""
        return max([1, *(value.numel() for value in self._raw_values().values()), *self._tie_lengths()])

    def _tie_lengths(self) -> list[int]:
        return [len(tie.total) for tie in self.form.ties.values() if tie.total is not None]

    def _check_channels(self) -> None:
        lengths = {key: value.numel() for key, value in self._raw_values().items() if value.ndim == 1}
        wrong = {key: n for key, n in lengths.items() if n != self.channels}
        wrong |= {
            key: len(tie.total)
            for key, tie in self.form.ties.items()
            if tie.total and len(tie.total) not in (1, self.channels)
        }
        if wrong:
            key, count = next(iter(wrong.items()))
            raise ParameterError(
                f"Expected {key} to have {self.channels} channels as the material's other parameters have, "
                f"got {count}. Give it one number, or one a channel.",
                field=key,
            )

    def _check_ties(self) -> None:
        values = self.values()
        for key, tie in self.form.ties.items():
            value = self.form.resolve(key, values).detach()
            if not bool(self.form.all_parameters[key].contains(value).all()):
                raise ParameterError(
                    f"Expected {key} to be in {self.form.all_parameters[key].box}, got "
                    f"{float(value.min()):.12g} from its tie to {tie.owner}. Change the owner's value or the total.",
                    field=key,
                )

    def _raw_values(self) -> dict[str, Tensor]:
        return {key: self.get_parameter(f"raw.{key}") for key in self.form.parameters}

    def values(self) -> dict[str, Tensor]:
        """The natural values by key, () or (C,), differentiable."""
        return {key: self.form.parameters[key].from_raw(raw) for key, raw in self._raw_values().items()}

    def project_(self) -> "Material":
        """Put every stored value back into its box, in place; for use after an optimiser's step."""
        with torch.no_grad():
            for key, raw in self._raw_values().items():
                raw.copy_(self.form.parameters[key].to_raw(self.form.parameters[key].from_raw(raw)))
        return self

    def _values_like(self, *directions: Tensor) -> dict[str, Tensor]:
        """The values in the dtype and on the device of the directions: a float64 one would promote float32 results."""
        dtype, device = functools.reduce(torch.promote_types, (w.dtype for w in directions)), directions[0].device
        return {key: value.to(dtype=dtype, device=device) for key, value in self.values().items()}

    def f(self, wi: Directions, wo: Directions) -> Spectrum:
        """The BRDF [1/sr], (..., C) or (..., 1) when gray; exactly 0 where a direction is not above the horizon."""
        g = geometry(wi, wo, self.form.needs)
        return self.form.f(self._values_like(wi, wo), g)

    def pdf(self, wi: Directions, wo: Directions) -> Density:
        """The density with which `sample` draws wi for wo, per solid angle [1/sr], (...)."""
        g = geometry(wi, wo, self.form.pdf_needs)
        return self.form.pdf(self._values_like(wi, wo), g)

    def sample(self, wo: Directions, u: Directions) -> Directions:
        """Directions wi (..., 3) drawn for wo, from u (..., 3) uniform in [0, 1).

        A wi may lie below the horizon: its weight is 0 and it must not be drawn again.
        """
        return self.form.sample(self._values_like(wo), wo, u.to(wo))

    def weight(self, wi: Directions, wo: Directions) -> Spectrum:
        """The quotient f cos theta_i / pdf [1], (..., C), which a sample contributes; 0 where the density is."""
        density = self.pdf(wi, wo).unsqueeze(-1)
        drawn = density > 0
        return torch.where(drawn, self.f(wi, wo) * wi[..., 2:] / torch.where(drawn, density, 1.0), 0.0)

    def forward(self, wi: Directions, wo: Directions) -> Spectrum:
        """The same as `f`."""
        return self.f(wi, wo)

    def __str__(self) -> str:
        return self.form.text({key: value.detach().tolist() for key, value in self.values().items()})

    def to_json(self) -> dict[str, Any]:
        """The material as JSON-able data, exact."""
        values = {key: value.detach().tolist() for key, value in self.values().items()}
        return {"terms": self.form.to_json(), "values": values}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> "Material":
        """The material that `to_json` wrote; raises where the data is none."""
        try:
            terms = tuple(
                Term(
                    entry["label"],
                    MODELS[entry["model"]](entry["options"]),
                    tuple(
                        (name, Tie(tie["owner"], None if tie["total"] is None else tuple(tie["total"])))
                        for name, tie in entry["ties"].items()
                    ),
                )
                for entry in data["terms"]
            )
            values = data["values"]
        except (KeyError, TypeError, AttributeError) as error:
            raise ModelTextError(
                f"Expected a material's JSON with terms and values, got something without {error}. "
                "Pass what Material.to_json returned.",
                field="model",
            ) from error
        return cls(Form(terms), values)


def material(text: str) -> Material:
    """The material that a text describes, as in "lambert(kd=0.17) + ward_bounded(isotropic, rs=0.05, a=0.03)"."""
    form, values, _ = build(parse(text))
    return Material(form, values)
