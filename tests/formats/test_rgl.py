"""RGL's tensor files: layout, the warps, the samples at the file's own nodes, and values beside Mitsuba's."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from rgl_file import rgl_arrays, rgl_bytes, tensor_file

from brdfcore.errors import FormatError
from brdfcore.formats import _size, read, rgl
from brdfcore.formats._warp import Corners, Table, Warp

Write = Callable[[str | bytes], Path]

FILES = [
    "aurora_white",
    "cc_green_malachite",
    "cc_ibiza_sunset",
    "chm_light_blue",
    "chm_orange",
    "cm_military_green",
    "ilm_solo_m_68",
    "irid_flake_paint1",
    "vch_silk_blue",
]
# Mitsuba computes in single precision, and a direction of single precision moves in narrow lobes
AGREEMENT = 1e-3
INSIDE = 0.02  # cosine down to which they are compared: the grid's edge


def hemisphere(rng: np.random.Generator, count: int, least: float = 0.0) -> np.ndarray:
    """Unit vectors of single precision."""
    z, phi = rng.uniform(least, 1, count), rng.uniform(0, 2 * np.pi, count)
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], -1).astype("f4").astype("f8")


@pytest.mark.parametrize("azimuths", [(0.0,), (-3.1, -2.0, -1.0, 0.0)], ids=["isotropic", "anisotropic"])
def test_samples_are_the_values_at_their_directions(azimuths, write: Write) -> None:
    path = write(tensor_file(rgl_arrays(azimuths=azimuths)))
    samples, tables = read(path), rgl.load(path)
    assert samples.channels == ("r", "g", "b")
    assert samples.azimuth_observed == (len(azimuths) > 1)
    assert len(samples) + samples.masked[0].count == len(azimuths) * 5 * 6 * 6
    wi, wo = samples.wi.numpy(), samples.wo.numpy()
    u, v, _ = tables.vndf.invert(*tables.half_square(wi, wo), tables.corners(wi))
    inner = (np.minimum(u, v) > 0.01) & (np.maximum(u, v) < 0.99)  # on the edge, one direction has several nodes
    assert inner.sum() > 40
    # at the poles the azimuth of wi is lost, and with it which of the measured ones it was
    inner &= (wi[:, 2] < 0.999) | (len(azimuths) == 1)
    np.testing.assert_allclose(tables.f(wi[inner], wo[inner]), samples.values.numpy()[inner], rtol=1e-5)


def test_spectral_files_have_a_channel_a_wavelength(write: Write) -> None:
    colour, spectral = rgl_arrays(), rgl_arrays(wavelengths=(400.0, 500.5, 700.0))
    spectral["spectra"] = colour["rgb"]
    samples = read(write(tensor_file(spectral)))
    assert samples.channels == ("400", "500.5", "700")
    assert torch.equal(samples.values, read(write(tensor_file(colour))).values)


def test_warps_are_inverted_and_their_densities_are_true() -> None:
    rng = np.random.default_rng(3)
    warp = Warp(rng.uniform(0, 1, (4, 7, 6)) ** 2)
    at = Corners.between([np.array([0.0, 1.0]), np.array([0.0, 0.5])], [np.full(5000, 0.3), np.full(5000, 0.1)])
    u, v = rng.uniform(0, 1, (2, 5000))
    x, y, density = warp.sample(u, v, at)
    back_u, back_v, again = warp.invert(x, y, at)
    np.testing.assert_allclose([back_u, back_v], [u, v], atol=1e-9)
    np.testing.assert_allclose(again, density, rtol=1e-6)
    np.testing.assert_allclose(warp.density(x, y, at), density, rtol=1e-6)
    # the mean of any g over samples is the integral of g times the density
    grid = (np.arange(200) + 0.5) / 200
    gx, gy = (a.ravel() for a in np.meshgrid(grid, grid))
    here = Corners.between([np.array([0.0, 1.0]), np.array([0.0, 0.5])], [np.full(40000, 0.3), np.full(40000, 0.1)])
    whole = warp.density(gx, gy, here)
    assert whole.mean() == pytest.approx(1, abs=1e-3)
    assert (whole * gx * gy**2).mean() == pytest.approx((x * y**2).mean(), abs=4 / np.sqrt(5000))


def test_tables_are_linear_between_their_nodes() -> None:
    values = np.arange(24.0).reshape(2, 3, 4)
    at = Corners.between([np.array([1.0, 3.0])], [np.array([1.0, 2.0, 9.0])])
    x, y = np.array([0.0, 0.5, 1.0]), np.array([0.0, 0.25, 1.0])
    np.testing.assert_allclose(Table(values)(x, y, at), [0.0, 1.5 + 2.0 + 6.0, 23.0])


@pytest.mark.parametrize("name", FILES)
def test_the_peak_is_where_a_mirror_would_be(name: str, measured: Path) -> None:
    """At each angle of incidence, the brightest node, by its own cosine, near the mirror direction."""
    samples = read(measured / "rgl" / f"{name}_rgb.bsdf")
    assert samples.values.max() > 0
    assert samples.azimuth_observed is False
    for wi in samples.wi.unique(dim=0):
        if not 0.3 < wi[2] < 0.95:
            continue
        here = (samples.wi == wi).all(-1)
        brightest = (samples.values.mean(-1) * samples.wo[:, 2])[here].argmax()
        mirror = torch.stack([-wi[0], -wi[1], wi[2]])
        angle = torch.rad2deg(torch.acos((samples.wo[here][brightest] * mirror).sum().clamp(max=1)))
        assert angle < 6, wi


@pytest.mark.parametrize("name", FILES)
def test_values_and_densities_are_mitsubas(name: str, measured: Path) -> None:
    mitsuba = pytest.importorskip("mitsuba", reason="needs the renderer Mitsuba 3: pip install -e '.[peers]'")
    mitsuba.set_variant("scalar_rgb")
    compare(mitsuba, measured / "rgl" / f"{name}_rgb.bsdf", 60)


@pytest.mark.full
@pytest.mark.parametrize("name", FILES)
def test_many_values_and_densities_are_mitsubas(name: str, measured: Path) -> None:
    mitsuba = pytest.importorskip("mitsuba", reason="needs the renderer Mitsuba 3: pip install -e '.[peers]'")
    mitsuba.set_variant("scalar_rgb")
    compare(mitsuba, measured / "rgl" / f"{name}_rgb.bsdf", 2000)


@pytest.mark.parametrize("azimuths", [(-3.1415927, -2.0, -1.0, 0.0), (-3.1415927, -2.3, -1.5707964)])
def test_anisotropic_values_are_mitsubas(azimuths: tuple[float, ...], tmp_path: Path) -> None:
    """The measured half or quarter of the azimuths stands for the others by the sample's symmetry."""
    mitsuba = pytest.importorskip("mitsuba", reason="needs the renderer Mitsuba 3: pip install -e '.[peers]'")
    mitsuba.set_variant("scalar_rgb")
    path = tmp_path / "made.bsdf"
    path.write_bytes(tensor_file(rgl_arrays(azimuths=azimuths)))
    compare(mitsuba, path, 200)


def compare(mitsuba, path: Path, count: int) -> None:
    """In Mitsuba `si.wi` is the side that the table is given, and the value includes the other side's cosine."""
    tables = rgl.load(path)
    bsdf = mitsuba.load_dict({"type": "measured", "filename": str(path)})
    rng = np.random.default_rng(8)
    wi = hemisphere(rng, count, INSIDE)
    wo = tables.sample(wi, *rng.uniform(0, 1, (2, count)))
    wo = np.where((rng.uniform(0, 1, count) < 0.5)[:, None], wo, hemisphere(rng, count, INSIDE))
    wi, wo = (w[wo[:, 2] > INSIDE].astype("f4").astype("f8") for w in (wi, wo))
    context, si = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f()
    values, densities = [], []
    for given, other in zip(wi.tolist(), wo.tolist(), strict=True):
        si.wi = mitsuba.Vector3f(*given)
        values.append(list(bsdf.eval(context, si, mitsuba.Vector3f(*other))))
        densities.append(bsdf.pdf(context, si, mitsuba.Vector3f(*other)))
    floor = 1e-4 * np.max(values)  # below it single precision has few digits of a difference left
    np.testing.assert_allclose(tables.f(wi, wo) * wo[:, 2:], values, rtol=AGREEMENT, atol=AGREEMENT * floor)
    np.testing.assert_allclose(tables.pdf(wi, wo), densities, rtol=AGREEMENT, atol=AGREEMENT * np.max(densities) * 1e-4)


def changed(**arrays: np.ndarray | None) -> bytes:
    whole = rgl_arrays() | arrays
    return tensor_file({name: array for name, array in whole.items() if array is not None})


ARRAYS = rgl_arrays()
BAD = [
    (changed(vndf=None), "to hold 'vndf', got none"),
    (changed(sigma=ARRAYS["sigma"][0]), "sigma to be an array of 2 dimensions, got shape (8,)"),
    (changed(ndf=ARRAYS["ndf"] * np.float32("nan")), "ndf to be finite"),
    (changed(luminance=ARRAYS["luminance"][:, :3]), "luminance to be of shape (1, 5)"),
    (changed(rgb=ARRAYS["rgb"][:, :, :2]), "the values to be 3 channels of luminance's shape, got shape"),
    (changed(ndf=ARRAYS["ndf"][:1]), "ndf to be at least 2 x 2"),
    (changed(theta_i=ARRAYS["theta_i"][::-1].copy()), "theta_i to be increasing angles"),
    (changed(vndf=0 * ARRAYS["vndf"]), "vndf to be a density"),
    (rgl_bytes()[:200], "to list arrays that it holds, got"),
    (rgl_bytes()[:3000], "beyond the end of its 3,000 bytes"),
    (b"tensor_file\0\2\0" + rgl_bytes()[14:], "to start with 'tensor_file' and version 1.0"),
    (b"tensor_file\0\1\0\xff\xff\xff\xff", "got 4294967295 fields"),
    (rgl_bytes().replace(b"phi_i\1\0\x0a", b"phi_i\1\0\x63"), "got type 99 of 1 dimensions for 'phi_i'"),
]


@pytest.mark.parametrize(("content", "message"), BAD)
def test_damage_is_one_sentence(content: bytes, message: str, write: Write) -> None:
    with pytest.raises(FormatError, match=re.escape(message)):
        read(write(content), format="rgl")


def test_a_file_without_light_is_refused(write: Write) -> None:
    horizon = ARRAYS["theta_i"][-1:]
    arrays = {name: ARRAYS[name][:, -1:] for name in ("vndf", "luminance", "rgb")}
    with pytest.raises(FormatError, match="hold a node above the horizon, got none"):
        read(write(changed(theta_i=horizon, **arrays)))


def test_small_types_count_as_the_numbers_that_they_become(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    numbers = sum(array.size for name, array in ARRAYS.items() if name != "description")
    monkeypatch.setattr(_size, "MOST_NUMBERS", numbers)
    read(write(rgl_bytes()))
    monkeypatch.setattr(_size, "MOST_NUMBERS", numbers - 1)
    with pytest.raises(FormatError, match=rf"a file of at most {numbers - 1:,} numbers, got {numbers:,}\. Split it"):
        read(write(rgl_bytes()))
