"""ASTM E1392-style files: what VARS names, leaves out, and declares."""

from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from format_cases import ASTM
from mirror_peak import brightest

from brdfcore.errors import FormatError, SamplesError, UnknownNameError
from brdfcore.formats import Masked, Samples, read

Write = Callable[[str | bytes], Path]


def expected() -> Samples:
    return Samples.from_angles([45, 30, 60], [0, 0, 90], [45, 10, 20], [180, 20, 30], [12.5, 0.25, 0.125], "degrees")


def test_a_whole_file(write: Write) -> None:
    samples = read(write(ASTM))
    assert samples.hash == expected().hash
    assert (samples.format, samples.channels) == ("astm", ("value",))


def test_phi_s_may_be_missing_from_vars(write: Write) -> None:
    assert read(write(ASTM.replace("theta_s,phi_s", "theta_s"))).hash == expected().hash


def test_phi_s_is_never_invented(write: Write) -> None:
    rows = "45,0,45,12.5\n30,0,10,.25\n60,90,20,.125\n"
    text = ASTM[: ASTM.index("VARS")] + "VARS theta_i,phi_i,theta_s,bsdf\n" + rows
    with pytest.raises(FormatError, match="VARS to name phi_s, or to leave out phi_s alone while its column is there"):
        read(write(text))


def test_without_phi_i_the_azimuth_was_not_observed(write: Write) -> None:
    head = ASTM[: ASTM.index("VARS")]
    samples = read(write(f"{head}VARS theta_i,theta_s,phi_s,bsdf\n45,45,180,12.5\n30,10,20,.25\n60,20,30,.125\n"))
    assert samples.azimuth_declared is False
    assert samples.wi[:, 1].abs().max() == 0


def test_units_and_quantity_are_declared_somewhere(write: Write) -> None:
    bare = ASTM.replace("ANGLE_UNIT degrees\n", "").replace("bsdf", "Integrated [300,700]".replace(",", "-"))
    with pytest.raises(FormatError, match="quantity to be declared") as caught:
        read(write(bare))
    assert caught.value.field == "quantity"
    with pytest.raises(FormatError, match=r"angle_unit to be declared .* The file does not say it: pass angle_unit\."):
        read(write(bare), quantity="brdf")
    assert read(write(bare), quantity="brdf", angle_unit="degrees").hash == expected().hash
    with pytest.raises(SamplesError, match=r"theta_i to be at most 90 degrees from the normal, .* at line 4\."):
        read(write(bare), quantity="brdf", angle_unit="radians")
    with pytest.raises(FormatError, match="angle_unit to be 'degrees' as the file has it, got 'radians'"):
        read(write(ASTM), angle_unit="radians")
    with pytest.raises(UnknownNameError, match="got 'gon'"):
        read(write(ASTM.replace("degrees", "gon")))
    with pytest.raises(FormatError, match="one unit of angles, got degrees, radians"):
        read(write(ASTM.replace("theta_i,", "theta_i_rad,")))
    assert read(write(ASTM.replace("degrees", "deg"))).hash == expected().hash


@pytest.mark.parametrize(
    ("names", "channels"), [("R,G,B", ("r", "g", "b")), ("X,Y,Z", ("x", "y", "z")), ("400,550.5", ("400", "550.5"))]
)
def test_channels(names: str, channels: tuple[str, ...], write: Write) -> None:
    row = "45,0,45,180," + ",".join("123"[: len(channels)])
    text = f"ANGLE_UNIT deg\nVARS theta_i,phi_i,theta_s,phi_s,{names}\n{row}\n"
    samples = read(write(text), quantity="brdf")
    assert samples.channels == channels
    assert samples.values.tolist() == [[1.0, 2.0, 3.0][: len(channels)]]


def test_white_space_may_stand_between_the_numbers(write: Write) -> None:
    head, rows = ASTM.split("bsdf\n")
    assert read(write(f"{head}bsdf\n{rows.replace(',', ' ')}")).hash == expected().hash


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("NUM_POINTS 3", "NUM_POINTS 4"), "as many rows as NUM_POINTS says, 4, got 3. The file is damaged or"),
        (("NUM_POINTS 3", "NUM_POINTS 9876543210987654321"), "NUM_POINTS says, 9876543210987654321, got 3"),
        (("NUM_POINTS 3", "NUM_POINTS"), "as many rows as NUM_POINTS says, nothing, got 3"),
        (("VARS", "VARIABLES"), "a line VARS that names the columns, got none"),
        (("theta_s,", ""), "VARS to name theta_s, got theta_i, phi_i, phi_s, bsdf"),
        (("theta_i,", ""), "VARS to name theta_i, or to leave out phi_s alone"),
        (("theta_i,", "theta_i,theta_i,"), "VARS to name theta_i once, got it twice"),
        ((",bsdf", ",bsdf,temperature"), "R, G, B, or X, Y, Z, or wavelengths in nm, got bsdf, temperature"),
        ((",bsdf", ""), "wavelengths in nm, got none"),
        (("30,0,10,20,0.25", "30,0,10,20"), "Expected line 6 to have 5 columns as the header has, got 4"),
        (("30,0,10,20", "30,0,,20"), "every angle to be a number, got an empty cell at line 6"),
        (("12.5", "nan"), "Expected bsdf at line 5 to be a finite number, got 'nan'"),
    ],
)
def test_damaged_files_are_refused(change: tuple[str, str], words: str, write: Write) -> None:
    with pytest.raises(FormatError) as caught:
        read(write(ASTM.replace(*change, 1)), format="astm")
    assert words in str(caught.value)


def test_an_empty_value_is_masked(write: Write) -> None:
    samples = read(write(ASTM.replace("0.25\n", "\n")))
    assert samples.masked == (Masked("a value's cell is empty", 1),)
    assert torch.equal(samples.values, torch.tensor([[12.5], [0.125]], dtype=torch.float64))


def test_a_real_measurement_written_so_peaks_at_the_mirror_direction(measured: Path, write: Write) -> None:
    """Cornell's own rows under ASTM's header, with phi_s left out of it as some instruments do."""
    lines = (measured / "cornell" / "garnet_red.brdf").read_text().split("\n")
    rows = [line.split() for line in lines if not line.startswith("#") and len(line.split()) == 35]
    header = f"NUM_POINTS {len(rows)}\nVARS theta_i,phi_i,theta_s,{','.join(str(w) for w in range(400, 701, 10))}\n"
    body = "".join(",".join(row) + "\n" for row in rows)
    samples = read(write(header + body), quantity="brdf", angle_unit="radians")
    assert samples.hash == read(measured / "cornell" / "garnet_red.brdf").hash
    assert brightest(samples, 1) < 1


def test_vars_may_be_the_first_line(write: Write) -> None:
    """A CSV header would look the same but for this word."""
    assert read(write(ASTM[ASTM.index("VARS") :]), angle_unit="degrees").format == "astm"
