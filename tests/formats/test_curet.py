"""CUReT's two files, of which one is named and one material is chosen."""

from pathlib import Path

import pytest
import torch
from format_cases import curet_files
from mirror_peak import brightest

from brdfcore.errors import FormatError
from brdfcore.formats import curet, read


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    values, table = curet_files()
    (tmp_path / "abrdf.dat").write_bytes(values)
    (tmp_path / "table.txt").write_bytes(table)
    return tmp_path / "abrdf.dat", tmp_path / "table.txt"


def test_a_material_is_chosen_by_its_number(files: tuple[Path, Path]) -> None:
    samples = read(files[0], material=2)
    assert read(files[0], material="2").hash == samples.hash
    assert read(files[0], material=1).hash != samples.hash
    assert len(samples) == 205
    assert samples.source == "abrdf.dat, material 2"
    row, geometry = (file.read_text().split("\n")[index].split() for file, index in zip(files, (1, 0), strict=True))
    assert samples.values[0].item() == float(row[1])
    assert samples.wo[0, 2].item() == pytest.approx(torch.tensor(float(geometry[1])).cos().item(), abs=1e-6)
    assert samples.wi[0, 2].item() == pytest.approx(torch.tensor(float(geometry[3])).cos().item(), abs=1e-6)


@pytest.mark.parametrize("material", [None, 3, "felt", 1.5])
def test_the_choices_are_listed(material: object, files: tuple[Path, Path]) -> None:
    got = "nothing" if material is None else str(material)
    with pytest.raises(FormatError, match=rf"one of the 2 numbers in abrdf\.dat \(1 to 2\), got {got}\.") as caught:
        read(files[0], material=material)  # type: ignore[arg-type]
    assert caught.value.field == "material"


def test_the_table_has_to_lie_beside(files: tuple[Path, Path]) -> None:
    files[1].unlink()
    with pytest.raises(FormatError, match=r"Expected table\.txt, which holds the directions, to lie beside abrdf\.dat"):
        read(files[0], material=1)


def test_who_gives_the_table_is_told_which_file_to_give(files: tuple[Path, Path]) -> None:
    told = r"Expected the file with CUReT's values, got table\.txt, .* Read abrdf\.dat with table\.txt beside it;"
    with pytest.raises(FormatError, match=told):
        read(files[1])
    files[1].write_text(files[1].read_text().replace("205 ", "204 "))
    with pytest.raises(FormatError, match="pass columns"):
        read(files[1])


@pytest.mark.parametrize(
    ("index", "change", "words"),
    [
        (0, ("\n2 ", "\nx "), "number at line 2 to be a finite number, got 'x'. Correct it, in abrdf.dat."),
        (0, ("\n2 ", "\n1 "), "one of the 2 numbers in abrdf.dat (1 to 1), got 1"),
        (1, ("\n7 ", "\n8 "), "Expected table.txt to number its 205 geometries from 1 on, got 205 rows"),
        (1, ("\n205 ", "\n# "), "number its 205 geometries from 1 on, got 204 rows"),
        (1, ("\n7 ", "\n7 7 "), "Expected line 7 to have 5 columns as the header has, got 6."),
        (1, ("\n7 ", "\n7 7 "), "and that the file is whole, in table.txt."),
    ],
)
def test_damaged_files_are_refused(index: int, change: tuple[str, str], words: str, files: tuple[Path, Path]) -> None:
    files[index].write_text(files[index].read_text().replace(*change, 1))
    with pytest.raises(FormatError) as caught:
        read(files[0], format="curet", material=1)
    assert words in str(caught.value)


def test_a_direction_below_the_horizon_is_named_by_line(files: tuple[Path, Path]) -> None:
    lines = files[1].read_text().split("\n")
    lines[3] = "4 1.8 0 0.5 0"
    files[1].write_text("\n".join(lines))
    with pytest.raises(ValueError, match=r"theta_o to be at most 90 degrees .* at line 4 of table\.txt\."):
        read(files[0], material=1)


@pytest.mark.parametrize("material", [9, 15, 17, 20, 25])
def test_real_materials_peak_at_the_mirror_direction(material: int, measured: Path) -> None:
    samples = read(measured / "curet" / "abrdf.dat", material=material)
    assert len(samples) == 205
    assert samples.channels == ("value",)
    assert samples.azimuth_observed
    # the three brightest of 205; seen from the other side, where phi_v = phi_i, they would be 135 deg away
    assert brightest(samples, 3).max() < 10


def test_every_real_material_is_read(measured: Path) -> None:
    materials = [read(measured / "curet" / "abrdf.dat", material=k + 1) for k in range(61)]
    assert sum(int((samples.values < 0).sum()) for samples in materials) == 29
    assert len({samples.hash for samples in materials}) == 61
    assert curet.GEOMETRIES == 205
