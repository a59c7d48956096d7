"""MERL's binary tables: layout, angle convention, masking."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from format_cases import SMALL_MERL, merl_bytes, merl_centres
from reconstruction import merl_reconstruction

from brdfcore.errors import FormatError
from brdfcore.formats import Masked, merl, read

Write = Callable[[str | bytes], Path]

NEGATIVE = "value is negative, which MERL uses for invalid bins"
BELOW = "a direction at the bin's centre is at or below the horizon"


@pytest.fixture(scope="session")
def full_merl(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of MERL's true size with simple values."""
    path = tmp_path_factory.mktemp("merl") / "made.binary"
    path.write_bytes(merl_bytes())
    return path


def turn(v: np.ndarray, axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """v turned about an axis (Rodrigues)."""
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return v * c + np.cross(axis, v) * s + axis * (v @ axis)[:, None] * (1 - c)


def half_difference_angles(wi: np.ndarray, wo: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """theta_h, phi_h, theta_d, phi_d as the database's BRDFRead.cpp defines them (Rusinkiewicz 1998)."""
    half = wi + wo
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    theta_h, phi_h = np.arccos(half[:, 2]), np.arctan2(half[:, 1], half[:, 0])
    difference = turn(wi, np.array([0.0, 0.0, 1.0]), -phi_h)
    difference = turn(difference, np.array([0.0, 1.0, 0.0]), -theta_h)
    return theta_h, phi_h, np.arccos(difference[:, 2]), np.arctan2(difference[:, 1], difference[:, 0])


def file_index(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """The bin that BRDFRead.cpp looks up for a pair of directions: theta_h by its square root, phi_d modulo 180 deg."""
    theta_h, _, theta_d, phi_d = half_difference_angles(wi, wo)
    phi_d = np.where(phi_d < 0, phi_d + np.pi, phi_d)
    i = np.floor(np.sqrt(theta_h / (np.pi / 2)) * 90).astype(int)
    j = np.floor(theta_d / (np.pi / 2) * 90).astype(int)
    k = np.floor(phi_d / np.pi * 180).astype(int)
    return (i * 90 + j) * 180 + k


def test_the_grid_inverts_the_databases_own_lookup() -> None:
    wi, wo, _ = merl.grid()
    theta_h, phi_h, theta_d, phi_d = half_difference_angles(wi, wo)
    for found, centre, name in zip((theta_h, theta_d, phi_d), merl_centres(), ("h", "d", "phi"), strict=True):
        # arccos near 1 loses 1e-16 / theta_h (at least 5e-5 rad), and phi_d divides that by theta_d > 9e-3
        np.testing.assert_allclose(found, centre, rtol=0, atol=1e-9, err_msg=name)
    np.testing.assert_allclose(phi_h, 0, atol=1e-10)
    np.testing.assert_allclose(np.linalg.norm(wi, axis=-1), 1, rtol=4e-16)
    np.testing.assert_allclose(np.linalg.norm(wo, axis=-1), 1, rtol=4e-16)
    np.testing.assert_array_equal(file_index(wi, wo), np.arange(90 * 90 * 180))
    # by reciprocity the other direction may be called the light
    np.testing.assert_array_equal(file_index(wo, wi), np.arange(90 * 90 * 180))


def test_the_cells_measure_the_whole_of_half_angle_space() -> None:
    _, _, cell = merl.grid()
    # integral of sin theta_h over 0..90 deg is 1, of sin cos theta_d is 1/2, of phi_d is pi; midpoints err by h^2/24
    assert cell.sum() == pytest.approx(math.pi / 2, rel=2e-4)
    assert cell.min() > 0


def test_a_full_file(full_merl: Path) -> None:
    samples = read(full_merl)
    assert samples.format == "merl"
    assert samples.channels == ("r", "g", "b")
    assert not samples.azimuth_observed
    wi, wo, cell = merl.grid()
    above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    assert samples.masked == (Masked(NEGATIVE, int((~above).sum())),)
    assert len(samples) == above.sum()
    assert samples.cell is not None
    np.testing.assert_array_equal(samples.cell.numpy(), cell[above])
    np.testing.assert_allclose(samples.wi.numpy(), wi[above], rtol=0, atol=4e-16)
    np.testing.assert_allclose(samples.wo.numpy(), wo[above], rtol=0, atol=4e-16)
    theta_h, theta_d, _ = (a[above] for a in merl_centres())
    red = 0.1 + np.exp(-((theta_h / 0.1) ** 2)) + 0.01 * theta_d
    np.testing.assert_allclose(samples.values.numpy(), red[:, None] * [1, 2, 3], rtol=1e-14)
    report = samples.report()
    assert 0 < report["theta_i_deg"][0] < report["theta_i_deg"][1] < 90
    assert report["samples"] + report["masked"][0]["count"] == 90 * 90 * 180


def test_bins_below_the_horizon_with_a_value_are_masked_for_that_reason(small_merl: object, write: Write) -> None:
    content = bytearray(merl_bytes())
    stored = np.frombuffer(content, dtype="<f8", offset=12).reshape(3, -1)
    below = int((stored[0] < 0).sum())
    stored[:] = np.abs(stored)
    stored[1, 0] = -0.5  # one channel's is enough
    samples = read(write(bytes(content)))
    assert below > 0
    assert samples.masked == (Masked(NEGATIVE, 1), Masked(BELOW, below))
    assert len(samples) == math.prod(SMALL_MERL) - 1 - below
    assert samples.values.min() > 0


def test_the_quantity_is_the_formats_own(small_merl: object, write: Write) -> None:
    assert len(read(write(merl_bytes()), quantity="brdf")) > 0
    with pytest.raises(FormatError, match="quantity to be 'brdf' as the file has it, got 'reflectance_factor'"):
        read(write(merl_bytes()), quantity="reflectance_factor")


@pytest.mark.parametrize(("change", "word"), [(-8, "truncated"), (-5760, "truncated"), (1, "too long")])
def test_the_size_is_checked_first(change: int, word: str, small_merl: object, write: Write) -> None:
    content = merl_bytes()
    size = 12 + 3 * 6 * 5 * 8 * 8
    assert len(content) == size
    damaged = content[:change] if change < 0 else content + bytes(change)
    with pytest.raises(FormatError) as caught:
        read(write(damaged), format="merl")
    assert f"to hold {size:,} bytes, got {size + change:,}. It is {word}: fetch it again." in str(caught.value)


def test_a_truncated_full_file_names_both_sizes(full_merl: Path, write: Write) -> None:
    with full_merl.open("rb") as file:
        path = write(file.read(1_000_000))
    with pytest.raises(FormatError, match=r"to hold 34,992,012 bytes, got 1,000,000\. It is truncated"):
        read(path)


@pytest.mark.parametrize(
    ("head", "got"), [(b"", "nothing"), (b"\x5a", "nothing"), (np.array([64, 64, 64], "<i4").tobytes(), "64 64 64")]
)
def test_other_dimensions_are_refused(head: bytes, got: str, write: Write) -> None:
    path = write(head or b"\0")
    with pytest.raises(FormatError, match=f"start with the dimensions 90 90 180, got {got}. Check"):
        read(path, format="merl")


def test_values_that_are_not_finite_are_refused_by_bin(small_merl: object, write: Write) -> None:
    content = bytearray(merl_bytes())
    np.frombuffer(content, dtype="<f8", offset=12).reshape(3, *SMALL_MERL)[1, 2, 3, 4] = np.nan
    with pytest.raises(
        FormatError, match=r"finite, got nan in the green plane at bin \(2, 3, 4\)\. The file is damaged"
    ):
        read(write(bytes(content)))


def test_a_file_without_a_valid_bin_is_refused(small_merl: object, write: Write) -> None:
    content = merl_bytes()[:12] + np.full(3 * math.prod(SMALL_MERL), -1.0).tobytes()
    with pytest.raises(FormatError, match="at least one valid bin, got 240 invalid ones"):
        read(write(content))


def test_a_reconstructed_material_peaks_at_the_half_vector(measured: Path, tmp_path: Path) -> None:
    path = tmp_path / "reconstructed.binary"
    path.write_bytes(merl_reconstruction(measured, "blue-metallic-paint"))
    samples = read(path)
    (masked,) = samples.masked
    assert "negative" in masked.reason
    assert len(samples) + masked.count == 90 * 90 * 180
    half = samples.wi + samples.wo
    theta = torch.rad2deg(torch.acos((half[:, 2] / half.norm(dim=-1)).clamp(max=1)))
    steep = samples.wi[:, 2] > math.cos(math.radians(45))
    near, far = (steep & (theta < 2)), (steep & (theta > 40))
    assert samples.values[near].mean() > 5 * samples.values[far].mean()


def test_the_planes_are_scaled_as_the_databases_own_reader_does(small_merl: tuple[int, int, int], write: Write) -> None:
    """BRDFRead.cpp multiplies what is stored by 1/1500, 1.15/1500 and 1.66/1500 for red, green and blue."""
    stored = np.full((3, math.prod(small_merl)), 1500.0)
    samples = read(write(np.array(small_merl, "<i4").tobytes() + stored.astype("<f8").tobytes()))
    np.testing.assert_allclose(samples.values.unique(dim=0).numpy(), [[1.0, 1.15, 1.66]], rtol=1e-15)
