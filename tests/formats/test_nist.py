"""NIST's Mueller-matrix CSV: wavelengths become channels; and the real sintered PTFE."""

from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from format_cases import NIST
from mirror_peak import from_mirror

from brdfcore.errors import FormatError, SamplesError
from brdfcore.formats import Masked, Samples, read

Write = Callable[[str | bytes], Path]


def test_wavelengths_become_channels(write: Write) -> None:
    samples = read(write(NIST))
    expected = Samples.from_angles(
        [-45, -45, -30], 0, [45, 20, 10], [0, 30, 20], [[1.25, 1.5]] + [[0.0, 0.0]] * 2, "degrees"
    )
    assert torch.equal(samples.wi, expected.wi)
    assert torch.equal(samples.wo, expected.wo)
    assert samples.channels == ("532", "633")
    assert samples.values.tolist() == [[1.25, 1.5], [0.25, 0.5], [0.125, 0.25]]
    assert not samples.azimuth_observed


def test_a_negative_theta_is_the_same_tilt_on_the_other_side(write: Write) -> None:
    samples = read(write(NIST))
    assert from_mirror(samples)[0] < 1e-6
    again = read(write(NIST.replace(",-45,0,", ",45,180,")))
    torch.testing.assert_close(again.wi, samples.wi, rtol=0, atol=2e-16)


def test_a_geometry_that_lacks_a_wavelength_is_masked(write: Write) -> None:
    samples = read(write(NIST.replace("0.633,-30,0,10,20,0.25,.1\n", "")))
    assert samples.masked == (Masked("a value's cell is empty", 1),)
    assert len(samples) == 2


def test_a_repeated_geometry_is_kept(write: Write) -> None:
    again = NIST + "0.532,-45,0,45,0,1.75,.1\n0.633,-45,0,45,0,2.5,.1\n"
    samples = read(write(again))
    assert samples.values[:, 0].tolist() == [1.25, 0.25, 0.125, 1.75]
    assert samples.values[3].tolist() == [1.75, 2.5]


def test_the_other_spelling_of_the_notes_serves(write: Write) -> None:
    changed = NIST.replace("phi,thetar", "phii,thetar").replace("f_r11,", "fr11,", 1).replace("f_r12/f_r11", "m12")
    assert read(write(changed)).hash == read(write(NIST)).hash


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            ("phir,", ""),
            "names lambda, thetai, phi, thetar, phir, f_r11, each once, got lambda, thetai, phi, thetar, f_r11",
        ),
        (("f_r12/f_r11", "phi"), "each once, got lambda, thetai, phi"),
        (("0.532,-45,0,20", "-0.532,-45,0,20"), "got an empty cell or none at line 3. Correct the row"),
        (("0.532,-45,0,20", "0.532,,0,20"), "got an empty cell or none at line 3"),
        (("0.25,.1", "x,.1"), "Expected f_r11 at line 3 to be a finite number, got 'x'"),
        (("0.532,-45,0,45,0,1.25,.1", "0.532,-45,0,45,0,1.25"), "Expected line 2 to have 7 columns"),
    ],
)
def test_damaged_files_are_refused(change: tuple[str, str], words: str, write: Write) -> None:
    with pytest.raises(FormatError) as caught:
        read(write(NIST.replace(*change, 1)), format="nist")
    assert words in str(caught.value)


def test_steep_angles_are_named_by_line(write: Write) -> None:
    with pytest.raises(
        SamplesError, match=r"theta_o to be at most 90 degrees from the normal, got 95 degrees at line 4\."
    ):
        read(write(NIST.replace("-30,0,10", "-30,0,95")))


def test_wavelengths_without_end_are_refused(write: Write) -> None:
    rows = "".join(f"{0.3 + k * 1e-4:.5f},-45,0,45,0,1,1\n" for k in range(1001))
    with pytest.raises(FormatError, match="at most 1000 wavelengths, got 1001"):
        read(write(NIST.split("\n", 1)[0] + "\n" + rows))


def test_what_the_format_defines_may_not_be_contradicted(write: Write) -> None:
    with pytest.raises(FormatError, match="angle_unit to be 'degrees' as the file has it, got 'radians'"):
        read(write(NIST), angle_unit="radians")
    with pytest.raises(FormatError, match="quantity to be 'brdf' as the file has it"):
        read(write(NIST), quantity="reflectance_factor")


def test_real_ptfe(measured: Path) -> None:
    samples = read(measured / "nist_ptfe" / "PTFE.data.csv")
    assert len(samples) == 1824
    assert samples.channels == ("351", "532", "633", "1064")
    assert samples.masked == ()
    assert not samples.azimuth_observed
    steep = (
        samples.wi[:, 2] < 0.3
    )  # theta_i = 75 deg, where even this diffuser has a forward lobe, which peaks towards grazing
    f, off = samples.values[steep].mean(-1), from_mirror(samples)[steep]
    assert off[f.topk(5).indices].max() < 30  # on the other side it would be above 100
    assert f[off < 15].mean() > 1.5 * f[off > 60].mean()
