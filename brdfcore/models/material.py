"""A material: a Form and the numbers that go with it, as a torch module."""

import functools
from collections.abc import Mapping, Sequence
from typing import Any, cast

import torch
from torch import Tensor, nn

from .._types import Density, Directions, Spectrum
from ..errors import InvalidValueError, ModelTextError, ParameterError, unknown_name
from ..geometry import check_broadcast, check_directions, geometry
from .form import Form, build
from .text import ParsedTerm, Tie, parse

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
            value = _number(key, given[key]) if key in given else torch.tensor(parameter.default, dtype=torch.float64)
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
            parameter = self.form.all_parameters[key]
            value = values[tie.owner] if tie.total is None else self.form.difference(tie, values)
            parameter.check_shape(key, value.detach())
            slack = 4 * torch.finfo(torch.float64).eps * max(tie.total or (0.0,))  # the difference's own rounding
            low, high = parameter.ends(torch.float64)
            if bool(((value < low - slack) | (value > high + slack)).any()):
                raise ParameterError(
                    f"Expected {key} to be in {parameter.box}, got {float(value.detach().min()):.12g} from its tie to "
                    f"{tie.owner}. Change the owner's value or the total.",
                    field=key,
                )

    def _raw_values(self) -> dict[str, Tensor]:
        found: dict[str, Tensor] = {}
        for key in self.form.parameters:
            label, name = key.split(".")
            found[key] = cast(nn.ParameterDict, self.raw[label])[name]  # a plain tensor under functional_call
        return found

    def values(self) -> dict[str, Tensor]:
        """The natural values by key, () or (C,), differentiable."""
        return {key: self.form.parameters[key].from_raw(raw) for key, raw in self._raw_values().items()}

    def project_(self) -> "Material":
        """Put every stored value back into its box, in place, as far as its ties allow; call it after each step."""
        with torch.no_grad():
            for key, raw in self._raw_values().items():
                raw.clamp_(*(self.form.parameters[key].to_raw(end) for end in self.form.bounds(key, raw)))
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
        check_directions("wo", wo)
        if not isinstance(u, Tensor) or u.ndim == 0 or u.shape[-1] != 3:
            got = f"shape {tuple(u.shape)}" if isinstance(u, Tensor) else type(u).__name__
            raise InvalidValueError(
                f"Expected u to be a tensor of three numbers on the last axis, got {got}. Pass u as (..., 3).",
                field="u",
            )
        check_broadcast("wo and u", wo, u, field="u")
        u = u.to(wo).clamp(min=0, max=1 - torch.finfo(wo.dtype).eps / 2)  # rounding to float32 may reach 1
        return self.form.sample(self._values_like(wo), wo, u)

    def weight(self, wi: Directions, wo: Directions) -> Spectrum:
        """The quotient f cos theta_i / pdf [1], (..., C), which a sample contributes; 0 where the density is."""
        density = self.pdf(wi, wo).unsqueeze(-1)
        empty = density == 0
        return torch.where(empty, 0.0, self.f(wi, wo) * wi[..., 2:] / torch.where(empty, 1.0, density))

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
        match data:
            case {"terms": [_, *_] as entries, "values": dict() as values}:
                pass
            case dict():
                missing = next((part for part in ("terms", "values") if part not in data), "a term")
                raise _no_material(f"something without {missing!r}")
            case _:
                raise _no_material(repr(data))
        form, _, _ = build([_term(entry) for entry in entries])
        for term, entry in zip(form.terms, entries, strict=True):
            if term.label != entry["label"]:
                raise _no_material(f"the label {entry['label']!r} where {term.label!r} is due")
        for key, value in values.items():
            numbers = value if isinstance(value, list) else [value]
            if not all(isinstance(x, int | float) and not isinstance(x, bool) for x in numbers):
                raise _no_material(f"{key} = {value!r}")
        return cls(form, values)


def check_material(material: object) -> None:
    """Raise InvalidValueError where it is something else, as a text is."""
    if not isinstance(material, Material):
        raise InvalidValueError(
            f"Expected material to be a Material, got {type(material).__name__}. Make one with bc.material(text).",
            field="material",
        )


def _number(key: str, number: Number) -> Tensor:
    """A given value in double precision."""
    try:
        return torch.as_tensor(number, dtype=torch.float64).detach()
    except (TypeError, ValueError, RuntimeError):
        raise ParameterError(
            f"Expected {key} to be one number or one a channel, got {number!r}. Give {key.split('.')[1]} as such.",
            field=key,
        ) from None


def _no_material(got: str) -> ModelTextError:
    return ModelTextError(
        f"Expected a material's JSON with terms and values, got {got}. Pass what Material.to_json returned.",
        field="model",
    )


def _term(entry: object) -> ParsedTerm:
    """The term of one entry of a material's JSON."""
    match entry:
        case {"label": str(), "model": str(model), "options": [*options], "ties": dict() as ties}:
            if all(isinstance(word, str) for word in options):
                return ParsedTerm(model, tuple(options), {name: _tie(tie) for name, tie in ties.items()})
    raise _no_material(f"the term {entry!r}")


def _tie(tie: object) -> Tie:
    """The tie of one entry of a material's JSON."""
    match tie:
        case {"owner": str(owner), "total": None}:
            return Tie(owner)
        case {"owner": str(owner), "total": [_, *_] as total} if all(isinstance(x, int | float) for x in total):
            return Tie(owner, tuple(float(x) for x in total))
    raise _no_material(f"the tie {tie!r}")


def material(text: str) -> Material:
    """The material of a text, as in "lambert(kd=0.17) + ward_bounded(isotropic, rs=0.05, a=0.03)", or of a preset."""
    form, values, _ = build(parse(text))
    return Material(form, values)
