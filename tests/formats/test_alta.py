"""ALTA's text format: its parametrisations against plain geometry, segments, and what it refuses."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from format_cases import ALTA
from mirror_peak import brightest, from_mirror

from brdfcore.errors import FormatError, SamplesError
from brdfcore.formats import Samples, alta, read

Write = Callable[[str | bytes], Path]


def pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    """View and light, (N, 3), well above the horizon."""
    random = np.random.default_rng(5)
    w = random.normal(size=(2, count, 3))
    w[..., 2] = np.abs(w[..., 2]) + 0.2
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    return w[0], w[1]


def spherical(w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.arccos(w[:, 2]), np.arctan2(w[:, 1], w[:, 0])


def half_angles(v: np.ndarray, lit: np.ndarray) -> np.ndarray:
    """theta_h, phi_h, theta_d, phi_d by rotating the view with matrices, as Rusinkiewicz 1998 defines them."""
    half = v + lit
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    theta, phi = spherical(half)
    found = []
    for k in range(len(v)):
        c, s = np.cos(-phi[k]), np.sin(-phi[k])
        about_z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        c, s = np.cos(-theta[k]), np.sin(-theta[k])
        about_y = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        found.append(about_y @ about_z @ v[k])
    theta_d, phi_d = spherical(np.array(found))
    return np.stack([theta, phi, theta_d, phi_d], -1)


def coordinates(name: str, v: np.ndarray, lit: np.ndarray) -> np.ndarray:
    """ALTA's coordinates of pairs of directions, from its own definitions."""
    theta_v, phi_v = spherical(v)
    theta_l, phi_l = spherical(lit)
    half, back = (lit + v) / 2, (lit - v) / 2
    turn = np.arctan2(back[:, 1], back[:, 0]) - np.arctan2(half[:, 1], half[:, 0])
    flat = [np.hypot(w[:, 0], w[:, 1]) for w in (half, back)]
    columns = {
        "CARTESIAN": (*v.T, *lit.T),
        "SPHERICAL_TL_PL_TV_PV": (theta_l, phi_l, theta_v, phi_v),
        "RUSIN_TH_PH_TD_PD": half_angles(v, lit).T,
        "RUSIN_TH_TD_PD": half_angles(v, lit)[:, [0, 2, 3]].T,
        "ISOTROPIC_TV_TL_DPHI": (theta_v, theta_l, phi_l - phi_v),
        "ISOTROPIC_TL_TV_PROJ_DPHI": (theta_l, theta_v * np.cos(phi_v - phi_l), theta_v * np.sin(phi_v - phi_l)),
        "STARK_3D": (flat[0], np.linalg.norm(back, axis=-1), turn),
        "NEUMANN_3D": (flat[0], flat[1], turn),
    }
    return np.stack(columns[name], -1)


def invariants(v: np.ndarray, lit: np.ndarray) -> np.ndarray:
    """What an isotropic material can tell pairs of directions apart by."""
    turn = (v[:, 0] * lit[:, 1] - v[:, 1] * lit[:, 0]), (v * lit).sum(-1)
    return np.stack([v[:, 2], lit[:, 2], *turn], -1)


@pytest.mark.parametrize("name", alta._GEOMETRIES)
def test_every_parametrisation_gives_back_both_directions(name: str, write: Write) -> None:
    v, lit = pairs(40)
    x = coordinates(name, v, lit)
    rows = "".join(" ".join(f"{number:.17g}" for number in row) + f" {k + 1}\n" for k, row in enumerate(x))
    samples = read(write(f"#DIM {x.shape[1]} 1\n#PARAM_IN {name}\n#PARAM_OUT INV_STERADIAN\n{rows}"))
    wo, wi = samples.wo.numpy(), samples.wi.numpy()
    isotropic = alta._GEOMETRIES[name][1]
    if isotropic:
        np.testing.assert_allclose(invariants(wo, wi), invariants(v, lit), rtol=0, atol=1e-12)
    else:
        np.testing.assert_allclose(np.stack([wo, wi]), np.stack([v, lit]), rtol=0, atol=1e-12)
    assert samples.azimuth_observed is not isotropic
    assert samples.values[:, 0].tolist() == list(range(1, 41))


@pytest.mark.parametrize("name", ["CARTESIAN", "RUSIN_TH_TD_PD", "ISOTROPIC_TV_TL_DPHI"])
def test_a_real_measurement_written_so_peaks_at_the_mirror_direction(name: str, measured: Path, write: Write) -> None:
    given = read(measured / "cornell" / "garnet_red.brdf")
    x = coordinates(name, given.wo.numpy(), given.wi.numpy())
    values = given.values.mean(-1).tolist()
    rows = "".join(" ".join(f"{c:.17g}" for c in [*row, f]) + "\n" for row, f in zip(x.tolist(), values, strict=True))
    samples = read(write(f"#DIM {x.shape[1]} 1\n#PARAM_IN {name}\n#PARAM_OUT INV_STERADIAN\n{rows}"))
    assert brightest(samples, 1) < 1
    torch.testing.assert_close(from_mirror(samples), from_mirror(given), rtol=0, atol=1e-5)  # arccos near 1 loses half


def test_view_comes_first_and_segments_are_read_past(write: Write) -> None:
    samples = read(write(ALTA))
    assert samples.wo[1].tolist() == [0.0, 0.6, 0.8]
    assert samples.wi[1].tolist() == pytest.approx([-0.6, 0.0, 0.8])
    assert samples.values[:, 0].tolist() == [12.5, 0.25, 0.125]
    assert samples.sigma is None
    assert (samples.format, samples.quantity) == ("alta", "brdf")


def test_colours_and_other_outputs_have_to_be_declared(write: Write) -> None:
    text = "#DIM 3 3\n#PARAM_IN RUSIN_TH_TD_PD\n#PARAM_OUT RGB_COLOR\n#VS 1 0 1\n.1 .2 .3 1 2 3 9 9\n"
    with pytest.raises(FormatError, match=r"got nothing\. PARAM_OUT is RGB_COLOR, which does not say it") as caught:
        read(write(text))
    assert caught.value.field == "quantity"
    samples = read(write(text), quantity="brdf")
    assert samples.channels == ("r", "g", "b")
    weighted = ALTA.replace("INV_STERADIAN", "INV_STERADIAN_COSINE_FACTOR")
    with pytest.raises(FormatError, match=r"the outgoing direction's cosine, .* the light's, pass quantity='brdf_cos'"):
        read(write(weighted))
    assert read(write(weighted), quantity="brdf_cos").values[1].item() == pytest.approx(0.25 / 0.8)
    assert samples.values.tolist() == [[1.0, 2.0, 3.0]]
    with pytest.raises(FormatError, match="quantity to be 'brdf' as the file has it, got 'brdf_cos'"):
        read(write(ALTA), quantity="brdf_cos")
    with pytest.raises(FormatError, match="angle_unit to be 'radians' as the file has it, got 'degrees'"):
        read(write(ALTA), angle_unit="degrees")


@pytest.mark.parametrize(
    "name", ["RUSIN_TH_TD", "COS_TH", "STARK_2D", "STEREOGRAPHIC", "RETRO_TL_TVL_PROJ_DPHI", "RUSIN_VH", "MISSPELT"]
)
def test_parametrisations_that_leave_a_direction_open_are_refused_by_name(name: str, write: Write) -> None:
    with pytest.raises(
        FormatError, match=rf"gives both directions, got {name}\. Convert it .* to one of CART"
    ) as caught:
        read(write(ALTA.replace("CARTESIAN", name)))
    assert caught.value.field == "PARAM_IN"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("#PARAM_IN CARTESIAN\n", ""), "gives both directions, got nothing"),
        (("#DIM 6 1", "#DIM 4 1"), "Expected DIM to begin with 6, as CARTESIAN takes, got 4"),
        (("#DIM 6 1", "#DIM 6 0"), "how many coordinates and how many values (1 to 1000) a row has, got '6 0'"),
        (("#DIM 6 1", "#DIM 6 1000000"), "(1 to 1000) a row has, got '6 1000000'"),
        (("#VS 2", "#VS 3"), "#VS to be 0, 1 or 2, once or for each of 1 values, got '3'"),
        (("#VS 2", "#VS 0"), "Expected line 7 to have 7 columns as the header has, got 9"),
        (("0.25 0.2", "0.25 x"), "Expected segment 1 at line 8 to be a finite number, got 'x'"),
        (("0 0 1 0 0 1 0.125 0.1 0.2\n", "0.1 0\n"), "Expected line 9 to have 9 columns as the header has, got 2"),
    ],
)
def test_damaged_files_are_refused(change: tuple[str, str], words: str, write: Write) -> None:
    with pytest.raises(FormatError) as caught:
        read(write(ALTA.replace(*change, 1)), format="alta")
    assert words in str(caught.value)


def test_the_binary_format_is_refused_by_name(write: Write) -> None:
    head = "#DIM 6 1\n#PARAM_IN  CARTESIAN\n#PARAM_OUT INV_STERADIAN\n#FORMAT binary\n#SAMPLE_COUNT 2\n#BEGIN_STREAM\n"
    with pytest.raises(FormatError, match=r"in its text format, got its binary format\. Convert it with"):
        read(write(head.encode() + np.arange(14.0).tobytes() + b"\n#END_STREAM\n"))


def test_coordinates_without_meaning_are_refused_by_line(write: Write) -> None:
    head = "#DIM 3 1\n#PARAM_IN NEUMANN_3D\n#PARAM_OUT INV_STERADIAN\n"
    with pytest.raises(
        FormatError, match=r"NEUMANN_3D to give two directions, got none from \(0.9, 0.9, 0\) at line 5"
    ):
        read(write(f"{head}.1 .1 0 1\n.9 .9 0 1\n"))
    with pytest.raises(SamplesError, match=r"wi to be unit vectors .* at line 8\."):
        read(write(ALTA.replace("0 0.6 0.8 -0.6 0 0.8", "0 0.6 0.8 -0.6 0 0.9")))


def test_a_header_may_come_late_and_twice(write: Write) -> None:
    """Lines before the header are comments, and of a key the first holds."""
    samples = read(write("# a comment\n#ALTA HEADER\n" + ALTA.replace("#VS 2", "#VS 2\n#VS 0")))
    assert isinstance(samples, Samples)
    assert torch.equal(samples.values, read(write(ALTA)).values)
