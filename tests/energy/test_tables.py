"""Tables of albedos: what they claim holds between their nodes, and what is written is what is read."""

import io
import json
import math
import pathlib
import sys

import numpy as np
import pytest
import torch

import brdfcore as bc
from brdfcore.energy import _axes, _chebyshev, _table_files, _tabulate, albedo, tables
from brdfcore.energy.probe import symmetry
from brdfcore.errors import FormatError, InvalidValueError, UnknownNameError

SIGMA = "oren_nayar.sigma"
KD = "oren_nayar.kd"


def drawn(table: bc.AlbedoTable, count: int, seed: int) -> dict[str, torch.Tensor]:
    """Random points of a table, every second one within a few decades of the end of its polar angles."""
    generator = torch.Generator().manual_seed(seed)

    def u() -> torch.Tensor:
        return torch.rand(count, dtype=torch.float64, generator=generator)

    points = {"phi": 2 * math.pi * u() - math.pi}
    for axis in table.axes:
        if axis.name == "theta":
            high = min(axis.high, math.pi / 2 - 1e-9)
            near = high - (high - axis.low) * 10 ** (-8 * u())
            points["theta"] = torch.where(u() < 0.5, near, axis.low + (high - axis.low) * u())
        elif axis.name != "phi":
            low, high = (math.log(end) if axis.coordinate == "log" else end for end in (axis.low, axis.high))
            value = low + (high - low) * u()
            points[axis.name] = torch.exp(value) if axis.coordinate == "log" else value
    return points


def exact(table: bc.AlbedoTable, points: dict[str, torch.Tensor], tolerance: float) -> albedo.Albedo:
    """The albedos at points, (N, C), without the table."""
    values = {key: value.detach() for key, value in table.material.values().items()}
    values |= {key: value[:, None] for key, value in points.items() if key not in ("theta", "phi")}
    with torch.no_grad():
        return albedo.of_form(table.material.form, values, torch.cos(points["theta"]), points["phi"], tolerance)


def largest_error(table: bc.AlbedoTable, count: int = 150, seed: int = 1) -> float:
    """The largest difference at random points, as a share of max(1, albedo), beyond what the truth itself is off by."""
    points = drawn(table, count, seed)
    truth = exact(table, points, 0.1 * table.tolerance)
    beyond = (table(**points) - truth.values).abs() - truth.error
    return float((beyond / truth.values.clamp(min=1)).max())


CASES = {
    "exact": ("lambert(kd=[0.3, 0.1]) + oren_nayar", {SIGMA: None, KD: None}, 1e-7),
    "no axis but theta": ("lambert(kd=[0.5, 0.1]) + ward_bounded(isotropic, rs=0.5, a=0.02)", None, 1e-5),
    "width and reflectance": (
        "ward_bounded(isotropic)",
        {"ward_bounded.a": (0.02, 1.0), "ward_bounded.rs": None},
        1e-4,
    ),
    "azimuth": ("ward_bounded(rs=1, ax=0.2)", {"theta": (0, 1.55), "ward_bounded.ay": (0.1, 0.6)}, 1e-3),
    "divergent": (
        "coupled_lambert(f0=kurt.f0) + kurt(isotropic, ks=1, m=0.4)",
        {"theta": (0.0, 1.5), "kurt.alpha": (0, 0.5), "kurt.f0": None},
        1e-3,
    ),
}


@pytest.fixture(scope="module", params=CASES)
def table(request: pytest.FixtureRequest) -> bc.AlbedoTable:
    text, axes, tolerance = CASES[request.param]
    return bc.albedo_table(text, axes, tolerance, cache=None)


def test_what_is_claimed_holds_between_the_nodes(table: bc.AlbedoTable) -> None:
    assert table.met
    assert largest_error(table) <= table.error <= table.tolerance


def test_tables_are_small(table: bc.AlbedoTable) -> None:
    assert table.values.numel() <= 5000
    assert table.values.shape[-1] == table.material.channels
    assert [len(nodes) for nodes in table.nodes().values()] == list(table.values.shape[:-1])
    for axis in table.axes:
        nodes = table.nodes()[axis.name]
        assert (float(nodes[0]), float(nodes[-1])) == (axis.low, axis.high)
        assert bool((nodes.diff() > 0).all())


@pytest.mark.full
@pytest.mark.parametrize("seed", range(40))
def test_claims_hold_for_random_tables(seed: int) -> None:
    """Models, widths, ranges and tolerances drawn at random, without what diverges."""
    rng = np.random.default_rng(seed)
    lobe = ("ward_bounded", "kurt_plausible", "ashikhmin_shirley", "beckmann", "ggx")[seed % 5]
    shape = ("isotropic", "anisotropic")[seed // 5 % 2]
    *others, width = next(iter(bc.MODELS[lobe].with_words([shape]))).width_parameters  # type: ignore[attr-defined]
    low, high = np.sort(np.exp(rng.uniform(*np.log(width.search_range), 2)))
    fixed = "".join(f", {p.name}={np.exp(rng.uniform(*np.log(p.search_range)))}" for p in others)
    axes = {f"{lobe}.{width.name}": (low, max(high, 1.5 * low)), "lambert.kd": None}
    tolerance = float(10 ** rng.uniform(-5 if shape == "isotropic" else -4, -2))
    table = bc.albedo_table(f"lambert + {lobe}({shape}{fixed})", axes, tolerance, cache=None)
    assert largest_error(table, 500, seed) <= table.error
    assert table.met == (table.error <= table.tolerance)


# --- interpolation ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def rough() -> bc.AlbedoTable:
    """A table of an exact term, over everything it has."""
    return bc.albedo_table("oren_nayar(kd=[0.5, 0.25, 1])", {SIGMA: (0.05, 1.0)}, 1e-5, cache=None)


@pytest.fixture(scope="module")
def turned() -> bc.AlbedoTable:
    """A table of an anisotropic lobe."""
    return bc.albedo_table("ward_bounded(rs=1, ax=0.3, ay=0.6)", {"theta": (0, 1.3)}, 1e-2, cache=None)


def test_coefficients_and_polynomials_are_chebyshevs() -> None:
    x = _chebyshev.nodes(9)
    for k in range(9):
        values = torch.cos(k * torch.acos(x))
        expected = torch.zeros(9, dtype=torch.float64)
        expected[k] = 1
        torch.testing.assert_close(_chebyshev.coefficients(values), expected, rtol=0, atol=1e-15)
        torch.testing.assert_close(_chebyshev.polynomials(x, 9)[:, k], values, rtol=0, atol=1e-13)
    assert torch.equal(x, -x.flip(0)), "exactly symmetric, so that nested nodes are the same numbers"
    assert torch.equal(_chebyshev.nodes(17)[::2], x)
    coefficients = torch.tensor([[1.0, 0.5], [0.1, 0.01], [0.02, 0.03], [0.001, 0.0]])
    assert [_chebyshev.needed(coefficients, t) for t in (1e-4, 0.01, 0.035, 0.2, 5)] == [4, 3, 1 + 1, 1, 0]


@pytest.mark.parametrize(
    "axis",
    [
        _axes.of_theta(None),
        _axes.of_theta((0.2, 1.5)),
        _axes.PHI,
        _axes.Axis("a", 0.01, 2, "log"),
        _axes.Axis("b", -1, 3, "linear"),
    ],
    ids=lambda axis: axis.coordinate,
)
def test_coordinates_go_there_and_back(axis: _axes.Axis) -> None:
    x = torch.linspace(-1, 1, 101, dtype=torch.float64)
    values = axis.values(x)
    assert (float(values[0]), float(values[-1])) == (axis.high, axis.low)
    torch.testing.assert_close(axis.x(values), x, rtol=0, atol=2e-4 if axis.high == math.pi / 2 else 1e-7)


def test_values_broadcast_and_keep_dtype_and_channels(rough: bc.AlbedoTable) -> None:
    theta = torch.linspace(0, 1.5, 5, dtype=torch.float64)
    sigma = torch.tensor([[0.1], [0.9]], dtype=torch.float64)
    grid = rough(theta, **{SIGMA: sigma})
    assert (grid.shape, grid.dtype) == ((2, 5, 3), torch.float64)
    for i, j in ((0, 0), (1, 3)):
        torch.testing.assert_close(
            rough(float(theta[j]), **{SIGMA: float(sigma[i, 0])}), grid[i, j], rtol=1e-12, atol=0
        )
    single = rough(theta.float(), **{SIGMA: 0.9})
    assert (single.shape, single.dtype) == ((5, 3), torch.float32)
    torch.testing.assert_close(single.double(), grid[1], rtol=1e-6, atol=0)
    assert rough(0.0, **{SIGMA: 0.5}).shape == (3,)
    torch.testing.assert_close(grid[..., 1] / grid[..., 0], torch.full((2, 5), 0.5, dtype=torch.float64))


def test_many_points_go_in_blocks(rough: bc.AlbedoTable, monkeypatch: pytest.MonkeyPatch) -> None:
    points = drawn(rough, 100, 3)
    whole = rough(**points)
    monkeypatch.setattr(_chebyshev, "PRODUCTS", 200)
    torch.testing.assert_close(rough(**points), whole, rtol=1e-13, atol=0)


def test_a_long_lobe_needs_few_azimuths() -> None:
    """It would need 60 in cos 2 phi itself, and its narrow side lies where it always lies."""
    for widths in ("ax=0.1, ay=1", "ax=1, ay=0.1"):
        table = bc.albedo_table(f"ward_bounded(rs=1, {widths})", {"theta": (0, 1.5)}, 1e-3, cache=None)
        assert table.axes[1].name == "phi"
        assert table.values.shape[1] <= 14
        assert largest_error(table) <= table.error <= 1e-3


def test_every_azimuth_is_found_in_the_quadrant(turned: bc.AlbedoTable) -> None:
    phi = torch.tensor([0.4, -0.4, math.pi - 0.4, math.pi + 0.4, 0.4 - 2 * math.pi], dtype=torch.float64)
    values = turned(1.2, phi)
    torch.testing.assert_close(values, values[:1].expand(5, 1), rtol=1e-12, atol=0)
    assert float(turned(1.2, 0.0)) != pytest.approx(float(turned(1.2, math.pi / 2)), abs=0.02)


def test_the_azimuth_has_no_effect_where_the_material_is_isotropic(rough: bc.AlbedoTable) -> None:
    assert [axis.name for axis in rough.axes] == ["theta", SIGMA]
    assert torch.equal(rough(1.0, 2.0, **{SIGMA: 0.3}), rough(1.0, **{SIGMA: 0.3}))


@pytest.mark.parametrize("choice", [m for model in bc.MODELS.values() for m in model.with_words(())[-1:]], ids=str)
def test_every_model_is_symmetric_about_its_axes(choice: bc.Model) -> None:
    """What lets one quadrant of azimuths hold them all."""
    form = bc.material(f"{choice.name}({', '.join(choice.options)})").form
    values = {
        key: torch.tensor(0.3 * p.search_range[0] + (0.7 - 0.1 * k) * p.search_range[1], dtype=torch.float64)
        for k, (key, p) in enumerate(form.parameters.items())
    }
    assert symmetry(
        form, {k: v.clamp(max=1.0) if form.parameters[k].high <= 10 else v for k, v in values.items()}
    ).mirrored


def test_the_derivatives_are_those_of_the_interpolant(turned: bc.AlbedoTable, rough: bc.AlbedoTable) -> None:
    theta, phi, sigma = (
        torch.tensor(x, dtype=torch.float64, requires_grad=True)
        for x in ([0.1, 0.7, 1.2], [0.3, 1.0, 2.0], [0.1, 0.4, 0.9])
    )
    assert torch.autograd.gradcheck(lambda t, s: rough(t, **{SIGMA: s}), (theta, sigma))
    assert torch.autograd.gradcheck(lambda t, p: turned(t, p), (theta, phi))
    ends = torch.tensor([0.0, math.pi / 2], dtype=torch.float64, requires_grad=True)
    (slope,) = torch.autograd.grad(rough(ends, **{SIGMA: 0.5}).sum(), ends)
    assert bool(slope.isfinite().all())


def test_the_unchecked_form_can_be_batched(rough: bc.AlbedoTable) -> None:
    theta = torch.linspace(0, 2.0, 7, dtype=torch.float64)  # beyond the horizon it is the horizon's
    batched = torch.func.vmap(lambda t: rough.interpolate({"theta": t, SIGMA: 0.5}))(theta)
    torch.testing.assert_close(batched[:5], rough(theta[:5], **{SIGMA: 0.5}), rtol=1e-12, atol=0)
    assert torch.equal(batched[-1], batched[-2])


# --- how it is made ---------------------------------------------------------------------------------------------------


def test_a_reflectance_costs_next_to_nothing() -> None:
    text, width = "ward_bounded(isotropic, rs=1)", {"theta": (0, 1.4), "ward_bounded.a": (0.4, 0.8)}
    without = bc.albedo_table(text, width, 1e-2, cache=None)
    with_it = bc.albedo_table(text, width | {"ward_bounded.rs": None}, 1e-2, cache=None)
    assert with_it.values.shape == (*without.values.shape[:2], 2, 1)
    assert with_it.evaluations <= 1.5 * without.evaluations + 1000


def test_a_tie_to_a_total_a_channel_is_kept() -> None:
    text = "lambert(kd=[0.5, 0.3] - oren_nayar.kd) + oren_nayar(sigma=0.5)"
    table = bc.albedo_table(text, {KD: None, SIGMA: (0.2, 0.6)}, 1e-5, cache=None)
    assert (table.axes[1].low, table.axes[1].high) == (0.0, 0.3), "beyond it the other term would be negative"
    assert table.values.shape[1:] == (2, table.values.shape[2], 2)
    assert largest_error(table) <= table.error <= 1e-5


def test_the_progress_rises_to_one() -> None:
    seen: list[float] = []
    bc.albedo_table("oren_nayar", {SIGMA: None}, 1e-3, cache=None, progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


def test_an_axis_that_was_counted_too_low_is_counted_again(monkeypatch: pytest.MonkeyPatch) -> None:
    count = _tabulate._Work.count

    def careless(self, axis, share, through=None):  # type: ignore[no-untyped-def]
        return count(self, axis, share, through) if through else 3

    monkeypatch.setattr(_tabulate._Work, "count", careless)
    table = bc.albedo_table("oren_nayar", {SIGMA: None}, 1e-5, cache=None)
    assert table.met
    assert largest_error(table) <= table.error <= 1e-5


def test_a_quadrature_that_is_not_good_enough_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """With errors of 1e-3 in every value, no table is good to 1e-5, and none says so."""
    generator = torch.Generator().manual_seed(2)

    def noisy(*arguments: object) -> albedo.Albedo:
        found = albedo.of_form(*arguments)  # type: ignore[arg-type]
        noise = 2e-3 * torch.rand(found.values.shape, dtype=torch.float64, generator=generator) - 1e-3
        return albedo.Albedo(
            found.values + noise, torch.full_like(found.values, 1e-3), found.tolerance, False, 1, "noisy", 0.0
        )

    monkeypatch.setattr(_tabulate, "of_form", noisy)
    table = bc.albedo_table("oren_nayar", {SIGMA: None}, 1e-5, cache=None)
    assert not table.met
    assert 1e-3 <= table.error < 0.1
    assert largest_error(table) <= table.error


REFUSED = {
    "an unknown axis": (
        {"kurt.m": None},
        UnknownNameError,
        "Expected an axis to be a known name, got 'kurt.m'. Known: theta",
    ),
    "beyond the horizon": (
        {"theta": (0, 1.6)},
        InvalidValueError,
        r"theta to be a range within \[0, pi/2\], got \(0, 1.6\)",
    ),
    "upside down": ({SIGMA: (0.5, 0.1)}, InvalidValueError, "a range within .* It is the standard deviation of the"),
    "outside the box": (
        {KD: (0, 2)},
        InvalidValueError,
        r"Expected the axis oren_nayar.kd to be a range within \[0, 1\]",
    ),
    "one number": ({KD: 0.5}, InvalidValueError, "to be two numbers or None, got 0.5"),
    "a range of azimuths": ({"phi": (0, 1)}, InvalidValueError, "Expected the axis phi to have no range"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_axes_that_are_none_are_refused(case: str) -> None:
    axes, kind, words = REFUSED[case]
    with pytest.raises(kind, match=words) as refused:
        bc.albedo_table("oren_nayar", axes, cache=None)  # type: ignore[arg-type]
    assert refused.value.field == "axes"


@pytest.mark.parametrize("tolerance", [0.0, -1.0, 0.5, math.nan])
def test_a_tolerance_that_is_none_is_refused(tolerance: float) -> None:
    with pytest.raises(InvalidValueError, match=r"Expected tolerance to be within \[1e-12, 0.1\]"):
        bc.albedo_table("lambert", tolerance=tolerance, cache=None)


DIVERGENT: list[tuple[str, dict[str, tuple[float, float] | None]]] = [
    ("ward(isotropic)", {}),
    ("lambert(kd=[0.2, 0.5]) + ward_duer(ax=0.1, ay=0.3, rs=[0.1, 0])", {"lambert.kd": None}),
    ("kurt(isotropic, m=0.3, alpha=0)", {"kurt.alpha": (0.0, 0.2)}),
]


@pytest.mark.parametrize(("text", "axes"), DIVERGENT)
def test_what_diverges_needs_a_largest_angle(text: str, axes: dict[str, tuple[float, float] | None]) -> None:
    """Told before a table is begun, so that none is accepted that would fail."""
    with pytest.raises(InvalidValueError, match="Expected the axis theta to end before the horizon for") as refused:
        tables.check(bc.material(text), axes, 1e-2)
    assert refused.value.field == "axes"
    assert "such as 1.5 (86 for theta_deg)" in str(refused.value)
    assert tables.check(bc.material(text), axes | {"theta": (0.0, 1.5)}, 1e-2)[0].high == 1.5


def test_what_grows_by_less_than_the_tolerance_needs_none() -> None:
    """Up to the lowest height of a table; so does a term of which there is nothing."""
    assert tables.check(bc.material("lambert(kd=0.5) + ward(rs=1e-12, a=0.1) + ward_duer(rs=0)"), {}, 1e-3)


def test_growth_that_no_value_foretells_is_found_when_the_table_is_begun(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_tabulate, "growth", lambda form, values: None)
    assert tables.check(bc.material("ward"), {}, 1e-2)
    with pytest.raises(InvalidValueError, match="Expected the axis theta to end before the horizon for ward"):
        bc.albedo_table("ward", {}, 1e-2, cache=None)


def test_an_albedo_that_no_number_holds_is_refused() -> None:
    """Lafortune's peak beyond all numbers."""
    with pytest.raises(
        InvalidValueError, match=r"finite number all over the table, got none at theta = .*Narrow the ax"
    ):
        bc.albedo_table("lafortune(cx=-2, cy=-2, n=1000000)", {"theta": (0, 1.5)}, 1e-2, cache=None)


def test_a_table_that_would_be_too_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_tabulate, "MOST", 20)
    with pytest.raises(
        InvalidValueError, match=r"at most 20 numbers, got \d+ \(theta \d+ x oren_nayar.sigma \d+, 1 chan"
    ):
        bc.albedo_table("oren_nayar", {SIGMA: None}, 1e-5, cache=None)


def test_values_outside_the_table_are_refused(rough: bc.AlbedoTable) -> None:
    for given, kind, words in (
        ({"theta": 1.0}, InvalidValueError, "Expected oren_nayar.sigma to be given, since it is an axis"),
        (
            {"theta": 1.6, SIGMA: 0.5},
            InvalidValueError,
            r"Expected theta to be within the table, \[0, 1.5708\], got 1.6",
        ),
        ({"theta": math.nan, SIGMA: 0.5}, InvalidValueError, "Expected theta to be within the table"),
        ({"theta": 1.0, SIGMA: torch.tensor([0.5, 1.1])}, InvalidValueError, "got 1.1.* Make a table over a wider"),
        ({"theta": 1.0, SIGMA: 0.5, KD: 0.5}, UnknownNameError, "Expected a parameter of the table to be a known name"),
    ):
        with pytest.raises(kind, match=words):
            rough(**given)  # type: ignore[arg-type]


# --- files ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", ["npz", "json"])
def test_what_is_saved_is_what_is_loaded(tmp_path: pathlib.Path, turned: bc.AlbedoTable, suffix: str) -> None:
    path = turned.save(tmp_path / f"table.{suffix}")
    loaded = bc.AlbedoTable.load(path)
    assert torch.equal(loaded.values, turned.values)
    for name in ("axes", "tolerance", "error", "met", "evaluations", "seconds", "hash"):
        assert getattr(loaded, name) == getattr(turned, name)
    assert str(loaded.material) == str(turned.material)
    assert torch.equal(loaded(1.0, 0.5), turned(1.0, 0.5))
    assert repr(loaded) == repr(turned)
    assert repr(turned).startswith("AlbedoTable(ward_bounded(anisotropic): theta ")


def test_a_file_says_how_to_read_it(tmp_path: pathlib.Path) -> None:
    """The JSON's own words, followed with NumPy alone."""
    axes = {"theta": (0.0, 1.4), "ward_bounded.ay": (0.3, 0.6), "ward_bounded.rs": None}
    made = bc.albedo_table("ward_bounded(ax=0.3)", axes, 3e-2, cache=None)
    data = json.loads(made.save(tmp_path / "table.json").read_text())
    assert "max(1 - 2 theta / pi, 6.4e-13)^(1/3)" in data["how"]
    given = {"theta": 1.1, "phi": 2.3, "ward_bounded.ay": 0.45, "ward_bounded.rs": 0.7}
    known = data["material"]["values"] | given
    s = math.prod((known[r["above"]] / known[r["below"]]) ** r["power"] for r in data["stretch"])
    coordinate = {
        "theta": lambda v: max(1 - 2 * v / math.pi, 6.4e-13) ** (1 / 3),
        "phi": lambda v: math.cos(2 * v),
        "log": math.log,
        "linear": lambda v: v,
    }
    found = np.asarray(data["values"])
    for axis in data["axes"]:
        value = given[axis["name"]]
        if axis["name"] == "phi":
            value = math.atan(abs(math.tan(value)) / s)
        t, low, high = (coordinate[axis["coordinate"]](v) for v in (value, axis["low"], axis["high"]))
        x, n = 2 * (t - high) / (low - high) - 1, len(axis["nodes"])
        nodes = np.cos(np.pi * np.arange(n) / (n - 1))
        weights = [np.prod([(x - b) / (a - b) for b in nodes if b != a]) for a in nodes]  # Lagrange's polynomials
        found = np.tensordot(weights, found, axes=1)
    assert found[0] == pytest.approx(float(made(**given)), rel=1e-10)


@pytest.mark.parametrize(
    ("name", "content", "kind", "words"),
    [
        ("x.txt", b"", InvalidValueError, r"to end in .npz or .json, got '.txt'"),
        ("no/x.npz", b"", InvalidValueError, "Expected the table's folder to exist"),
        ("x.json", b"{", FormatError, "Expected a table of albedos, got x.json, JSONDecodeError"),
        ("x.json", b"[]", FormatError, "Expected a table of albedos"),
        ("x.json", b'{"kind": "other"}', FormatError, "got the kind 'other'"),
        ("x.json", b'{"axes": []}', FormatError, "KeyError: 'kind'"),
        ("x.npz", b"PK", FormatError, "Expected a table of albedos, got x.npz"),
    ],
)
def test_a_file_that_is_no_table_is_refused(
    tmp_path: pathlib.Path, name: str, content: bytes, kind: type[Exception], words: str
) -> None:
    path = tmp_path / name
    if path.parent.is_dir():
        path.write_bytes(content)
    with pytest.raises(kind, match=words):
        bc.AlbedoTable.load(path)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"values": [[1.0]]}, r"values of shape \(1, 1\) for axes of"),
        ({"values": None}, "Expected a table of albedos"),
        ({"axes": [{"name": "theta"}]}, "KeyError: 'low'"),
        ({"material": {"terms": []}}, "Expected a material's JSON"),
    ],
)
def test_data_that_are_no_table_are_refused(rough: bc.AlbedoTable, change: dict[str, object], words: str) -> None:
    with pytest.raises(bc.errors.BrdfError, match=words):
        bc.AlbedoTable.from_dict(rough.to_dict() | change)


# --- the cache --------------------------------------------------------------------------------------------------------


def must_not_run(*arguments: object) -> None:
    raise AssertionError("made again")


def test_a_table_is_kept_under_the_hash_of_what_made_it(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "new" / "folder"
    first = bc.albedo_table("oren_nayar(kd=0.5)", {SIGMA: None}, 1e-3, cache=folder)
    assert [path.name for path in folder.iterdir()] == [f"{first.hash}.npz"]
    monkeypatch.setattr(tables, "tabulate", must_not_run)
    again = bc.albedo_table("oren_nayar(kd=0.5, sigma=0.7)", {SIGMA: None}, 1e-3, cache=str(folder))
    assert torch.equal(again.values, first.values), "the value of an axis makes no other table"
    assert (again.hash, again.seconds) == (first.hash, first.seconds)
    for text, axes, tolerance in (
        ("oren_nayar(kd=0.500000000000001)", {SIGMA: None}, 1e-3),
        ("oren_nayar(kd=0.5)", {SIGMA: (0.1, 0.2)}, 1e-3),
        ("oren_nayar(kd=0.5)", {}, 1e-3),
        ("oren_nayar(kd=0.5)", {SIGMA: None}, 1e-4),
    ):
        with pytest.raises(AssertionError, match="made again"):
            bc.albedo_table(text, axes, tolerance, cache=folder)  # type: ignore[arg-type]
    monkeypatch.setattr(tables, "__version__", "0")
    with pytest.raises(AssertionError, match="made again"):
        bc.albedo_table("oren_nayar(kd=0.5)", {SIGMA: None}, 1e-3, cache=folder)


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 cut short", None])
def test_a_damaged_file_is_made_again(tmp_path: pathlib.Path, damage: bytes | None) -> None:
    first = bc.albedo_table("lambert", cache=tmp_path)
    path = tmp_path / f"{first.hash}.npz"
    if damage is None:
        np.savez(path, about=np.asarray(json.dumps({"kind": "other"})), values=np.zeros(3))
    else:
        path.write_bytes(damage)
    assert torch.equal(bc.albedo_table("lambert", cache=tmp_path).values, first.values)
    assert bc.AlbedoTable.load(path).hash == first.hash


def test_a_folder_that_cannot_be_written_keeps_nothing(tmp_path: pathlib.Path) -> None:
    (tmp_path / "file").touch()
    assert bc.albedo_table("lambert", cache=tmp_path / "file").met


def test_a_write_that_breaks_off_leaves_nothing(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(file: io.BufferedWriter, **more: object) -> None:
        file.write(b"PK")
        raise OSError("no space left on device")

    monkeypatch.setattr(_table_files.np, "savez", full)
    assert bc.albedo_table("lambert", cache=tmp_path).met
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_kept_where_nothing_is_asked_to_be(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    for nowhere in (None, False):
        bc.albedo_table("lambert", cache=nowhere)
    assert list(tmp_path.iterdir()) == []
    made = bc.albedo_table("lambert")
    assert tables.cache_folder() == tmp_path / "brdfcore" / "albedo"
    assert (tables.cache_folder() / f"{made.hash}.npz").is_file()


@pytest.mark.parametrize(
    ("platform", "expected"), [("darwin", "Library/Caches"), ("win32", "AppData/Local"), ("linux", ".cache")]
)
def test_the_users_cache_is_the_platforms(platform: str, expected: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", platform)
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    assert tables.cache_folder() == pathlib.Path.home() / expected / "brdfcore" / "albedo"
