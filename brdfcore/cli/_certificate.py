"""What `brdf check MATERIAL` prints: the verdict, the numbers behind it, and each term beside what its text says."""

import inspect
import json
import math
import re
import textwrap
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..energy.certificate import Certificate
    from ..models import Model
    from ..models.material import Material

ANGLES_DEG = (0, 30, 60, 75, 85, 89, 89.9)
WIDTH, INDENT = 120, 22  # characters


def check(text: str, *, as_json: bool) -> tuple[str, bool]:
    """The report on the material that a text or a preset's name describes, and whether it conserves energy."""
    import brdfcore as bc

    material = bc.material(text)
    whole = bc.certify(material)
    several = len(material.form.terms) > 1
    terms = [(label, says, bc.certify(alone) if several else whole) for label, says, alone in _terms(material)]
    if as_json:
        found = {"material": str(material), **whole.to_dict()}
        found["terms"] = [{"label": label, "says": says, "certificate": own.to_dict()} for label, says, own in terms]
        return json.dumps(found, indent=2), whole.energy_conserving
    lines = [
        *_wrapped(str(material)),
        "",
        *_wrapped(whole.verdict),
        "",
        *_numbers(whole),
        "",
        *_albedos(material, whole),
    ]
    for label, says, own in terms:
        lines += ["", *_row(f"{label} says", says), *(_row("found", own.verdict) if several else [])]
    cost = [whole, *(own for _, _, own in terms if several)]
    seconds, evaluations = sum(own.seconds for own in cost), sum(own.evaluations for own in cost)
    return "\n".join([*lines, "", f"{seconds:.2f} s, {evaluations} evaluations"]), whole.energy_conserving


def _terms(material: "Material") -> "list[tuple[str, str, Material]]":
    """Label, claim and a material of its own for each term, its ties replaced by values."""
    from ..models.form import Form, Term
    from ..models.material import Material

    values = {key: value.detach() for key, value in material.values().items()}
    return [
        (
            term.label,
            _says(term.model),
            Material(
                Form((Term(term.label, term.model),)),
                {f"{term.label}.{name}": value for name, value in material.form.of_term(term, values).items()},
            ),
        )
        for term in material.form.terms
    ]


def _says(model: "Model") -> str:
    """What the model's text says of reciprocity and energy: its paragraph that begins so, up to the next heading."""
    text = inspect.getdoc(inspect.getmodule(type(model))) or ""
    found = re.search(r"^(?:Reciprocal|Not reciprocal)\b.*?(?=^\w+: |\Z)", text, re.MULTILINE | re.DOTALL)
    return " ".join(found[0].split()) if found else ""


def _wrapped(text: str, indent: int = 0) -> list[str]:
    return textwrap.wrap(text, WIDTH, subsequent_indent=" " * indent, break_long_words=False, break_on_hyphens=False)


def _row(name: str, text: str) -> list[str]:
    return _wrapped(f"{name:<{INDENT}}{text}", INDENT)


def _numbers(it: "Certificate") -> list[str]:
    """The numbers of a certificate, one a line."""
    if math.isfinite(it.max_albedo):
        largest = f"{it.max_albedo:.7g} to within {it.error:.1g}, {it.place}"
    else:
        largest = f"no limit, {it.place}"
    if it.exceeds is None:
        above = "nowhere"
    else:
        first, last = (f"{math.degrees(theta):.7g}" for theta in it.exceeds)
        above = f"first at {first}, last at {last} degrees"  # between them it need not be
    grazing = f"like 1/{it.power}" if it.grazing_exponent else f"{it.grazing_limit:.7g}"
    rows = {
        "largest albedo": largest,
        "above 1": above,
        "towards grazing": grazing,
        "reciprocity error": f"{it.reciprocity_error:.2g} of f, over {it.pairs} pairs of directions",
        "smallest f": f"{it.min_value:.3g} 1/sr, over the same",
    }
    return [line for name, told in rows.items() for line in _row(name, told)]


def _albedos(material: "Material", it: "Certificate") -> list[str]:
    """A row of angles and one of albedos, at the azimuth and in the channel of the largest."""
    import torch

    import brdfcore as bc

    theta = torch.tensor(ANGLES_DEG, dtype=torch.float64).deg2rad()
    with torch.no_grad():
        albedos = bc.albedo(material, theta, it.at_phi, tolerance=1e-4).values[:, it.channel].tolist()
    azimuth = "" if it.isotropic else f" at azimuth {math.degrees(it.at_phi):.3g}"
    shown = [f"{value:.4g}" for value in albedos]
    wide = max(8, 2 + max(map(len, shown)))
    return [
        f"{'theta [degrees]':<{INDENT}}" + "".join(f"{angle:<{wide}g}" for angle in ANGLES_DEG).rstrip(),
        f"{'albedo' + azimuth:<{INDENT}}" + "".join(f"{value:<{wide}}" for value in shown).rstrip(),
    ]
