"""An effect that is absent adds no operation: the operations that torch executes are counted, their graph is traced.

Views are not counted: they compute nothing. Every comparison is over the registry: a new model or option is in it.
"""

from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest
import torch
from model_cases import CHOICE_IDS, CHOICES, EVERY_CHOICE, draw_values, form_of, hemisphere, material_of
from torch.fx.experimental.proxy_tensor import make_fx
from torch.utils._python_dispatch import TorchDispatchMode

import brdfcore as bc
from brdfcore.geometry import Geometry, geometry
from brdfcore.models.form import Form
from brdfcore.parameters import Values

PAIRS = 13  # no number of bases or channels is the same
WI, WO = (hemisphere(np.random.default_rng(seed), PAIRS) for seed in (96, 97))
MASK = Counter(["aten.scalar_tensor.default", "aten.where.self"])  # of what lies below the horizon
U = torch.rand(PAIRS, 3, generator=torch.Generator().manual_seed(98), dtype=torch.float64)

every_choice = pytest.mark.parametrize("choice", EVERY_CHOICE, ids=CHOICE_IDS)


class Operations(TorchDispatchMode):
    """Records every operation that makes a new tensor: its name, and the shape of what it makes."""

    def __init__(self) -> None:
        super().__init__()
        self.executed: list[tuple[str, torch.Size]] = []

    def __torch_dispatch__(self, func, types, args=(), kwargs=None):
        result = func(*args, **(kwargs or {}))
        is_view = any(made.alias_info is not None for made in func._schema.returns)
        if isinstance(result, torch.Tensor) and not is_view:
            self.executed.append((str(func), result.shape))
        return result

    @property
    def counted(self) -> Counter[str]:
        return Counter(name for name, _ in self.executed)


def operations(compute: Callable[[], object]) -> Operations:
    with Operations() as seen:
        compute()
    return seen


def of_f(material: bc.Material) -> Operations:
    """What evaluating a material takes: its values, the geometry, the terms and their sum."""
    with torch.no_grad():
        material.f(WI, WO)  # tables are read once a process
        return operations(lambda: material.f(WI, WO))


def of_gradient(material: bc.Material) -> Operations:
    """What evaluating a material and differentiating by all its parameters takes."""
    material.f(WI, WO)
    return operations(lambda: torch.autograd.grad(material.f(WI, WO).sum(), list(material.parameters())))


def with_word(choice: bc.Model, old: str, new: str) -> bc.Model:
    return type(choice)([new if word == old else word for word in choice.options])


def test_the_counter_counts():
    """The test of the tests: one product and one sum, and no view."""
    x = torch.ones(3, 1)
    seen = operations(lambda: (x.expand(3, 2).unsqueeze(0) * 2 + x)[..., :1])
    assert seen.counted == {"aten.mul.Tensor": 1, "aten.add.Tensor": 1}
    assert seen.executed[0][1] == (1, 3, 2)


# (the absent effect's word, the word of its presence) for every choice that holds the first
SWITCHED = [
    (choice, off, on)
    for choice in CHOICES
    for group in choice.option_groups
    for off in ("isotropic", "constant")
    if off in choice.options and off in group
    for on in group
    if on != off
    and not any({on} < set(pair) <= {on, *choice.options} for pair in choice.apart)
    and not {on, *choice.options} >= {"schlick", "compensated"}  # a basis more instead of a sum
]


def test_every_switched_effect_is_known():
    """At least the lobes with a Fresnel factor and those with two widths; nothing was renamed away."""
    assert {on for _, _, on in SWITCHED} == {"anisotropic", "schlick", "scaled", "dielectric", "conductor"}
    assert len({choice.name for choice, _, _ in SWITCHED}) >= 11


@pytest.mark.parametrize(
    ("choice", "off", "on"), SWITCHED, ids=[f"{c.name}({','.join(c.options)})-{on}" for c, _, on in SWITCHED]
)
def test_an_effect_that_is_off_adds_no_operation(choice, off, on):
    """Off is a true part of on: each operation that is executed without the effect is executed with it, and more is.

    With derivatives it is less work, though not a part: one width that is read twice sums two derivatives.
    """
    absent, present = material_of(choice), material_of(with_word(choice, off, on))
    without, with_it = of_f(absent).counted, of_f(present).counted
    assert without < with_it, without - with_it
    assert of_gradient(absent).counted.total() < of_gradient(present).counted.total()


@every_choice
def test_colour_is_one_wide_product(choice):
    """A gray material and one of 31 channels take the same operations; wide are the sum over the terms and its mask."""
    values = draw_values(choice, np.random.default_rng(99), where="mild")
    coloured = {p.name: [values[p.name]] * 31 for p in choice.parameters if p.per_channel == "yes"}
    gray, colour = of_f(material_of(choice, values)), of_f(material_of(choice, values | coloured))
    assert gray.counted == colour.counted
    wide = [name for name, shape in colour.executed if shape == (PAIRS, 31)]
    products = [] if not choice.needs else ["aten.mul.Tensor" if len(choice.typical_albedo) == 1 else "aten.mm.default"]
    assert wide == [*products, "aten.where.self"]  # a basis that is the same for all pairs is not even that wide
    assert not [name for name, shape in gray.executed if shape == (PAIRS, 31)]


def in_vain(compute: Callable[[object], object], given: object) -> list[str]:
    """The inputs and operations of the traced graph that do not reach its output."""
    graph = make_fx(compute)(given).graph
    *body, output = graph.nodes
    reached = {output}
    for node in reversed(body):  # users come after what they use
        if not reached.isdisjoint(node.users):
            reached.add(node)
    return [str(node.target) for node in body if node.op != "get_attr" and node not in reached]


def test_what_is_in_vain_is_seen():
    """The test of the tests."""
    assert in_vain(lambda x: (torch.exp(torch.sin(x)), x + 1)[1], torch.ones(2)) == [
        "aten.sin.default",
        "aten.exp.default",
    ]


@every_choice
def test_nothing_is_computed_in_vain(choice):
    """In the graph of the geometry, and in that of the values and the terms, every operation reaches the result."""
    material = material_of(choice)
    g = geometry(WI, WO, material.form.needs)
    quantities = {name: quantity for name, quantity in g._asdict().items() if quantity is not None}
    with torch.no_grad():
        assert not in_vain(lambda some: material.form.f(material.values(), Geometry(**some)), quantities)
        assert not in_vain(lambda pair: geometry(*pair, material.form.needs), (WI, WO))


def of_terms(form: Form, values: Values, g: Geometry) -> Counter[str]:
    """What the terms take by themselves."""
    total: Counter[str] = Counter()
    for term in form.terms:
        own = form.of_term(term, values)
        total += operations(lambda own=own, model=term.model: (model.basis(own, g), model.coefficients(own))).counted
    return total


@every_choice
def test_a_sum_takes_what_its_terms_take_and_one_product(choice):
    """Nothing is computed for a term that is not in the text, and none of a term's work is done twice."""
    joined = Counter(["aten.cat.default", "aten.stack.default", "aten.mm.default"])
    for more in ("lambert", "kurt(anisotropic)", "ward_bounded + ggx(separable)"):
        form = bc.material(f"{form_of(choice).text()} + {more}").form
        values = {key: value.detach() for key, value in bc.Material(form).values().items()}
        g = geometry(WI, WO, form.needs)
        seen = operations(lambda form=form, values=values, g=g: form.f(values, g)).counted
        assert seen == of_terms(form, values, g) + joined + MASK


def test_geometry_is_computed_once_and_only_where_a_term_reads_it():
    """Of two terms that read the same of the geometry, the second adds nothing to it; Lambert's reads nothing."""
    for text in ("ward", "kurt(anisotropic)", "ggx"):
        needs = bc.material(text).form.needs
        alone = operations(lambda needs=needs: geometry(WI, WO, needs)).counted
        for more in (text, "lambert"):
            both = bc.material(f"{text} + {more}").form.needs
            assert operations(lambda both=both: geometry(WI, WO, both)).counted == alone


def test_one_term_is_no_mixture():
    """Sampling and density of a single term take what the term itself takes, and the mask or the guard of wo."""
    for choice in CHOICES:
        form = form_of(choice)
        values = {key: value.detach() for key, value in material_of(choice).values().items()}
        own, model = form.of_term(form.terms[0], values), form.terms[0].model
        g = geometry(WI, WO, form.pdf_needs)
        density = operations(lambda form=form, values=values, g=g: form.pdf(values, g)).counted
        assert density == operations(lambda model=model, own=own, g=g: model.pdf(own, g)).counted + MASK
        drawn = operations(lambda form=form, values=values: form.sample(values, WO, U)).counted
        alone = operations(lambda model=model, own=own: model.sample(own, WO, U[..., 1:])).counted
        assert drawn == alone + Counter({"aten.le.Scalar": 1, "aten.where.self": 1})
