"""Cornell's text format, and the three real files."""

from collections.abc import Callable
from pathlib import Path

import pytest
import torch

from brdfcore.errors import FormatError, SamplesError
from brdfcore.formats import Masked, Samples, cornell, read

Write = Callable[[str | bytes], Path]

CORNELL = """\
# num wls
2

# wls
400
410.5
# theta i, phi i, theta s, phi_s, spectral sample values
0.872665 0.000000 0.573513 0.000000 0.023025 0.013790
0.698132 0.000000 0.427512 -0.261799 0.000000 0.011102
"""


def test_rows_are_radians_and_brdf(write: Write) -> None:
    samples = read(write(CORNELL))
    expected = Samples.from_angles(
        [0.872665, 0.698132],
        [0, 0],
        [0.573513, 0.427512],
        [0, -0.261799],
        [[0.023025, 0.01379], [0, 0.011102]],
        "radians",
    )
    assert torch.equal(samples.wi, expected.wi)
    assert torch.equal(samples.wo, expected.wo)
    assert torch.equal(samples.values, expected.values)
    assert samples.channels == ("400", "410.5")
    assert (samples.format, samples.quantity) == ("cornell", "brdf")
    assert samples.report()["zero_values"] == 1


def test_rows_at_the_horizon_are_masked(write: Write) -> None:
    samples = read(write(CORNELL + "0.1 0 1.570796327 0 1 1\n"))
    assert len(samples) == 2
    assert samples.masked == (Masked("a direction is at the horizon, where no BRDF can be measured", 1),)


def test_what_the_format_defines_may_be_repeated_but_not_contradicted(write: Write) -> None:
    assert len(read(write(CORNELL), quantity="brdf", angle_unit="radians")) == 2
    with pytest.raises(FormatError, match="quantity to be 'brdf' as the file has it, got 'brdf_cos'"):
        read(write(CORNELL), quantity="brdf_cos")
    with pytest.raises(FormatError, match="angle_unit to be 'radians' as the file has it, got 'degrees'"):
        read(write(CORNELL), angle_unit="degrees")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("0.011102\n", ""), "rows of 6 numbers (4 angles and 2 values) after the wavelengths, got 11 numbers"),
        (("0.011102\n", ""), "which is 1 rows and 5 over (the last at line 9). The file is damaged or truncated"),
        (("0.013790", "nan"), "line 8 to hold finite numbers, got 'nan'"),
        (("400\n", "four hundred\n"), "line 5 to hold finite numbers, got 'four'"),
        (("2\n", "2.5\n"), "the number of wavelengths, then the wavelengths in nm in rising order, got 2.5 400 410.5"),
        (("410.5", "390"), "in rising order, got 2 400 390 0.872665. Check that this is a Cornell .brdf file."),
        (("2\n", "200\n"), "the number of wavelengths, then"),
        ((CORNELL, "# nothing\n"), "got no numbers."),
        ((CORNELL[CORNELL.index("0.872665") :], ""), "after the wavelengths, got 0 numbers"),
    ],
)
def test_damaged_files_are_refused(change: tuple[str, str], words: str, write: Write) -> None:
    with pytest.raises(FormatError) as caught:
        read(write(CORNELL.replace(*change, 1)), format="cornell")
    assert words in str(caught.value)


def test_angles_in_degrees_are_refused_by_line(write: Write) -> None:
    with pytest.raises(SamplesError, match=r"theta_i to be at most 90 degrees .* at line 8\."):
        read(write(CORNELL.replace("0.872665", "50.0")))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "31",
        "3 1 2 3\n",
        "2 500 400\n",
        "x 400 410\n",
        "-1 400\n",
        "0\n",
        "2.0 400 410\n",
        "99999 400\n",
        "2 400 abc\n",
    ],
)
def test_other_numbers_are_not_claimed(text: str) -> None:
    assert not cornell.sniff(text.encode())


@pytest.mark.parametrize("name", ["garnet_red", "cayman", "acryl_blue"])
def test_real_files_peak_at_the_mirror_direction(name: str, measured: Path) -> None:
    samples = read(measured / "cornell" / f"{name}.brdf")
    assert samples.format == "cornell"
    assert len(samples) == 1439
    assert samples.channels == tuple(str(wavelength) for wavelength in range(400, 701, 10))
    assert not samples.azimuth_observed
    assert samples.masked == ()
    assert samples.report()["zero_values"] > 0
    mirror = samples.wi * torch.tensor([-1.0, -1.0, 1.0], dtype=torch.float64)
    off = torch.rad2deg((mirror * samples.wo).sum(-1).clamp(-1, 1).acos())
    brightness = samples.values.mean(-1)
    # the five brightest of 1,439 lie within 15 deg (2 % of the hemisphere) of it; had phi_s another sense, none would
    assert off[brightness.topk(5).indices].max() < 15
    assert off[brightness.argmax()] < 1
    away = off > 60
    assert brightness[brightness.topk(5).indices].min() > 20 * brightness[away].median()
