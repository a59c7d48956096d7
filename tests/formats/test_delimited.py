"""CSV and its kin: reading, declarations, masking, and the round trip through write_csv."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mirror_peak import brightest

from brdfcore.errors import FormatError, SamplesError, UnknownNameError
from brdfcore.formats import Masked, Samples, read, write_csv

Write = Callable[[str | bytes], Path]

CSV = """\
# quantity: brdf
theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,r,g,b,sigma_r,sigma_g,sigma_b,weight
45,0,45,180,1.25,1.5,1.75,.01,.02,.03,1
30,0,10,20,0.25,0.5,0.75,.04,.05,.06,2
"""


def expected() -> Samples:
    return Samples.from_angles(
        [45, 30],
        [0, 0],
        [45, 10],
        [180, 20],
        [[1.25, 1.5, 1.75], [0.25, 0.5, 0.75]],
        "degrees",
        sigma=[[0.01, 0.02, 0.03], [0.04, 0.05, 0.06]],
        weight=[1, 2],
    )


def same(a: Samples, b: Samples) -> bool:
    pairs = [(getattr(a, name), getattr(b, name)) for name in ("wi", "wo", "values", "sigma", "weight", "cell")]
    close = [x is y if x is None or y is None else torch.allclose(x, y, rtol=1e-14, atol=4e-15) for x, y in pairs]
    return all(close) and a.channels == b.channels and a.azimuth_observed == b.azimuth_observed


def test_the_docstrings_example(write: Write) -> None:
    samples = read(write(CSV))
    assert same(samples, expected())
    assert (samples.format, samples.source, samples.masked) == ("csv", "measured.dat", ())


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace(",", ";"),
        lambda text: text.replace(",", "\t"),
        lambda text: text.replace(",", "  "),
        lambda text: text.replace(",", " , "),
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\r"),
        lambda text: "\ufeff" + text,
        lambda text: text.upper(),
        lambda text: text.replace("_o_", "_s_"),
        lambda text: text.replace("_o_", "_r_"),
        lambda text: text.rstrip("\n") + "\n\n# the end\n\n",
        lambda text: text.replace("# quantity", "# instrument: XYZ\n# just words\n\n#Quantity "),
        lambda text: text.replace("_deg", "").replace("# quantity", "# angle_unit: degrees\n# quantity"),
        lambda text: text.replace("# quantity", "# angle_unit: degrees\n# quantity"),
    ],
)
def test_spellings_that_mean_the_same(change: Callable[[str], str], write: Write) -> None:
    assert same(read(write(change(CSV))), expected())


def test_radians_in_the_names_and_as_an_argument(write: Write) -> None:
    text = "theta_i_rad,phi_i_rad,theta_o_rad,phi_o_rad,value\n0.5,0.25,0.75,-1,2\n"
    wanted = Samples.from_angles(0.5, 0.25, 0.75, -1.0, [2.0], "radians")
    assert same(read(write(text), quantity="brdf"), wanted)
    assert same(read(write(text.replace("_rad", "")), quantity="brdf", angle_unit="radians"), wanted)


def test_vectors(write: Write) -> None:
    text = "wi_x wi_y wi_z wo_x wo_y wo_z 450 650\n0.6 0 0.8 -0.6 0 0.8 1 2\n"
    samples = read(write(text), quantity="brdf")
    assert same(samples, Samples([[0.6, 0, 0.8]], [[-0.6, 0, 0.8]], [[1.0, 2.0]], ("450", "650")))


def test_the_quantity_is_converted(write: Write) -> None:
    text = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value,sigma\n60,0,10,0,1,.1\n"
    cos = read(write(text), quantity="brdf_cos")
    assert cos.values.item() == pytest.approx(2.0)
    factor = read(write("# quantity: reflectance_factor\n" + text))
    assert factor.values.item() == pytest.approx(1 / math.pi)
    assert factor.sigma is not None
    assert factor.sigma.item() == pytest.approx(0.1 / math.pi)
    assert factor.quantity == "reflectance_factor"


def test_one_sigma_serves_every_channel(write: Write) -> None:
    text = "# quantity: brdf\nwi_x,wi_y,wi_z,wo_x,wo_y,wo_z,r,g,b,sigma\n0,0,1,0,0,1,1,2,3,.5\n"
    sigma = read(write(text)).sigma
    assert sigma is not None
    assert sigma.tolist() == [[0.5, 0.5, 0.5]]


def test_what_was_not_measured_has_no_sigma(write: Write) -> None:
    text = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,r,g,b,sigma_r,sigma_g,sigma_b\n{}45,0,45,180,1,2,3,.1,.2,.3\n"
    for row in ("45,0,10,180,,,,,,\n", "45,0,10,180,1,,3,.1,,.3\n"):
        samples = read(write(text.format(row)), quantity="brdf")
        assert samples.masked == (Masked("a value's cell is empty", 1),)
        assert samples.sigma is not None
        assert samples.sigma.tolist() == [[0.1, 0.2, 0.3]]


def test_empty_values_and_horizon_rows_are_masked_with_reason_and_count(write: Write) -> None:
    rows = "45,0,45,180,1,,3,.1,.1,.1,1\n45,0,90,180,1,2,3,.1,.1,.1,1\n-90,0,0,0,1,2,3,.1,.1,.1,1\n"
    samples = read(write(CSV + rows))
    assert same(samples, expected())
    assert samples.masked == (
        Masked("a direction is at the horizon, where no BRDF can be measured", 2),
        Masked("a value's cell is empty", 1),
    )


def test_the_file_may_say_that_the_azimuth_was_not_observed(write: Write) -> None:
    rows = "# quantity: brdf\nwi_x,wi_y,wi_z,wo_x,wo_y,wo_z,value\n.6,0,.8,0,0,1,1\n0,.6,.8,0,0,1,1\n"
    assert read(write(rows)).azimuth_observed
    assert not read(write("# azimuth_observed: false\n" + rows)).azimuth_observed
    with pytest.raises(UnknownNameError, match="azimuth_observed to be a known name, got 'perhaps'"):
        read(write("# azimuth_observed: perhaps\n" + rows))


NO_UNIT = CSV.replace("_deg", "")


@pytest.mark.parametrize(
    ("text", "arguments", "words", "field"),
    [
        (CSV.replace("# quantity: brdf\n", ""), {}, "quantity to be declared ('brdf', 'brdf_cos',", "quantity"),
        (CSV, {"quantity": "brdf_cos"}, "quantity to be 'brdf' as the file has it, got 'brdf_cos'", "quantity"),
        ("# quantity: brdf_cos\n" + CSV, {}, "quantity to be declared once, got 'brdf_cos' and 'brdf'", "quantity"),
        (NO_UNIT, {}, "angle_unit to be declared ('degrees', 'radians'), got nothing. Name the", "angle_unit"),
        (CSV, {"angle_unit": "radians"}, "'degrees' as the file has it, got 'radians'", "angle_unit"),
        ("# angle_unit: radians\n" + CSV, {}, "'degrees' as the column theta_i has it, got 'radians'", "angle_unit"),
        (
            "# angle_unit: radians\n" + NO_UNIT,
            {"angle_unit": "degrees"},
            "'radians' as the file has it, got 'degrees'",
            "angle_unit",
        ),
    ],
)
def test_what_is_not_stated_once_is_an_error(
    text: str, arguments: dict[str, str], words: str, field: str, write: Write
) -> None:
    with pytest.raises(FormatError) as caught:
        read(write(text), **arguments)
    assert words in str(caught.value)
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("comment", "words"),
    [("# quantity: BRFD\n", "Did you mean 'brdf'?"), ("# angle_unit: grad\n", "Known: degrees, radians.")],
)
def test_unknown_declarations_list_the_known(comment: str, words: str, write: Write) -> None:
    with pytest.raises(UnknownNameError) as caught:
        read(write(comment + NO_UNIT.replace("# quantity: brdf\n", "")), quantity=None if "BRFD" in comment else "brdf")
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("change", "words", "field"),
    [
        (("45,0,45,180", "45,0,nan,180"), "theta_o_deg at line 3 to be a finite number, got 'nan'", "theta_o_deg"),
        (("1.75,", "Infinity,"), "b at line 3 to be a finite number, got 'Infinity'", "b"),
        (("30,0,", "30,,"), "phi_i_deg at line 4 to be a number, got an empty cell. Fill it in", "phi_i_deg"),
        ((".04", ""), "sigma_r at line 4 to be a number, got an empty cell", "sigma_r"),
        (
            ("30,0,10", "30,0,95"),
            "theta_o to be at most 90 degrees from the normal, got 95 degrees at line 4",
            "theta_o",
        ),
        ((".04", "-1"), "sigma to be positive and finite, got -1 at line 4, channel 'r'", "sigma"),
        ((".06,2", ".06,-2"), "weight to be finite and not negative, got -2 at line 4", "weight"),
    ],
)
def test_bad_rows_name_the_line(change: tuple[str, str], words: str, field: str, write: Write) -> None:
    with pytest.raises((FormatError, SamplesError)) as caught:
        read(write(CSV.replace(*change)))
    assert words in str(caught.value)
    assert caught.value.field == field


def test_vectors_that_are_not_unit_name_the_line(write: Write) -> None:
    text = "# quantity: brdf\n\nwi_x,wi_y,wi_z,wo_x,wo_y,wo_z,value\n0,0,1,0,0,1,1\n0,0,1,1,0,1,1\n"
    with pytest.raises(SamplesError, match=r"wo to be unit vectors .* got \(1, 0, 1\) at line 5\."):
        read(write(text))


def test_a_file_of_comments_has_no_header(write: Write) -> None:
    with pytest.raises(FormatError, match="Expected a header row that names the columns, got none"):
        read(write("# quantity: brdf\n"), format="csv")


@pytest.mark.parametrize("channels", [1, 3, 2])
@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(count=st.integers(1, 8), seed=st.integers(0, 2**32 - 1), extras=st.booleans(), exponent=st.integers(-300, 300))
def test_write_csv_reads_back(
    channels: int, count: int, seed: int, extras: bool, exponent: int, tmp_path: Path
) -> None:
    random = np.random.default_rng(seed)
    theta, phi = random.uniform(0, 89.999, (2, count)), random.uniform(-180, 180, (2, count))
    samples = Samples.from_angles(
        theta[0],
        phi[0],
        theta[1],
        phi[1],
        random.normal(size=(count, channels)) * 10.0**exponent,
        "degrees",
        channels=("450", "633.25") if channels == 2 else None,
        sigma=random.uniform(0.1, 1, (count, channels)) if extras else None,
        weight=random.uniform(0.1, 1, count) if extras else None,
        cell=random.uniform(0.1, 1, count) if extras else None,
        azimuth_observed=extras or None,
    )
    write_csv(samples, tmp_path / "out.csv", {"source": "hypothesis, 100 %"})
    again = read(tmp_path / "out.csv")
    assert same(samples, again)
    for name in ("values", "sigma", "weight", "cell"):
        if getattr(samples, name) is not None:
            assert torch.equal(getattr(samples, name), getattr(again, name)), name


def test_write_csv_writes_round_degrees_as_such(tmp_path: Path) -> None:
    write_csv(Samples.from_angles(30, 10, 60, 190, [0.1], "degrees"), tmp_path / "out.csv", {"note": "by hand"})
    assert (tmp_path / "out.csv").read_bytes().decode() == (
        "# note: by hand\n# quantity: brdf\n"
        "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n30.0,10.0,60.0,-170.0,0.1\n"
    )


def test_write_csv_refuses_what_would_not_read_back(tmp_path: Path) -> None:
    samples = Samples.from_angles(30, 10, 60, 190, [[0.1, 0.2]], "degrees")
    with pytest.raises(FormatError, match=r"channels to be value, or r, g, b, or wavelengths .* got c0, c1\. Write an"):
        write_csv(samples, tmp_path / "out.csv")
    named = Samples(samples.wi, samples.wo, samples.values, ("400", "500"))
    for comments in ({"quantity": "brdf"}, {"note": "two\nlines"}, {"no name": "x"}):
        with pytest.raises(FormatError, match="comments to be one line each under a name of their own"):
            write_csv(named, tmp_path / "out.csv", comments)
    assert not (tmp_path / "out.csv").exists()


HEADLESS = "# measured by hand\n45 -180 45 0 12.5\n30 -180 10 20 .25\n"
COLUMNS = "theta_i_deg, phi_i_deg, theta_o_deg, phi_o_deg, value"


def test_a_file_without_a_header_row_is_read_with_columns(write: Write) -> None:
    samples = read(write(HEADLESS), quantity="brdf", columns=COLUMNS)
    expected = Samples.from_angles([45, 30], -180, [45, 10], [0, 20], [12.5, 0.25], "degrees")
    assert samples.hash == expected.hash
    assert read(write(HEADLESS), quantity="brdf", columns=COLUMNS.split(", ")).hash == expected.hash
    with pytest.raises(SamplesError, match=r"at line 3\."):
        read(write(HEADLESS.replace("30 -180", "95 -180")), quantity="brdf", columns=COLUMNS)


def test_columns_replace_other_names(write: Write) -> None:
    named = "zenith;azimuth;zenith_out;azimuth_out;BRDF\n" + HEADLESS.split("\n", 1)[1].replace(" ", ";")
    samples = read(write(named), quantity="brdf", columns=COLUMNS)
    assert samples.hash == read(write(HEADLESS), quantity="brdf", columns=COLUMNS).hash


def test_columns_have_to_fit_the_file(write: Write) -> None:
    with pytest.raises(FormatError, match=r"columns to name 5 columns as line 2 has, got 2\.") as caught:
        read(write(HEADLESS), columns="value,sigma")
    assert caught.value.field == "columns"
    with pytest.raises(FormatError, match=r"a header row .* got '45 -180 45 0 12\.5' at line 2\. .* or pass columns"):
        read(write(HEADLESS), format="csv", quantity="brdf")


@pytest.mark.parametrize(("name", "off"), [("chassis_brdf", 2), ("solar_array_brdf", 2)])
def test_real_satellites_peak_at_the_mirror_direction(name: str, off: float, measured: Path) -> None:
    path = measured / "satellite" / f"{name}.csv"
    with pytest.raises(FormatError, match="For a table without a header row, pass columns"):
        read(path)
    samples = read(path, quantity="brdf", columns="theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value")
    assert len(samples) > 700
    assert not samples.azimuth_observed
    for theta in samples.wi[:, 2].unique():
        one = samples.subset(samples.wi[:, 2] == theta)
        assert brightest(one, 1).item() <= off
