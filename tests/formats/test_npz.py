"""npz archives: keys, declarations, and that nothing harmful is unpacked."""

import io
import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from format_cases import npz_arrays
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from brdfcore.errors import FormatError, SamplesError, UnknownNameError
from brdfcore.formats import Masked, Samples, _size, npz, read

Write = Callable[[bytes], Path]


def saved(arrays: dict[str, object]) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()


def zipped(members: list[tuple[str, bytes]]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members:
            archive.writestr(name, content)
    return stream.getvalue()


def npy(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def changed(**changes: object) -> dict[str, object]:
    """The complete archive's arrays with some replaced; None removes one."""
    return {name: array for name, array in {**npz_arrays(), **changes}.items() if array is not None}


def test_angles(write: Write) -> None:
    samples = read(write(saved(npz_arrays())))
    arrays = npz_arrays()
    expected = Samples.from_angles(
        *(arrays[name] for name in ("theta_i", "phi_i", "theta_o", "phi_o", "values")),
        "degrees",
        channels=("visible", "infrared"),
        sigma=arrays["sigma"],
        weight=arrays["weight"],
    )
    assert samples.hash == expected.hash
    assert (samples.format, samples.source) == ("npz", "measured.dat")


@pytest.mark.parametrize("extras", [False, True])
@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(count=st.integers(1, 8), channels=st.integers(1, 4), seed=st.integers(0, 2**32 - 1))
def test_vectors_read_back_bit_for_bit(extras: bool, count: int, channels: int, seed: int, tmp_path: Path) -> None:
    random = np.random.default_rng(seed)
    w = random.normal(size=(2, count, 3))
    w[..., 2] = np.abs(w[..., 2]) + 1e-3
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    values = random.normal(size=(count, channels))
    keywords = (
        {"sigma": np.abs(values) + 1, "weight": np.arange(1.0, count + 1), "cell": np.ones(count)} if extras else {}
    )
    samples = Samples(w[0], w[1], values, **keywords)
    path = tmp_path / "x"
    path.write_bytes(
        saved({"wi": samples.wi.numpy(), "wo": samples.wo.numpy(), "values": samples.values.numpy(), **keywords})
    )
    again = read(path, quantity="brdf")
    assert again.hash == samples.hash
    assert torch.equal(again.wi, samples.wi)


@pytest.mark.parametrize("dtype", [">f8", "<f4", "<i2", "<u8", "<f2"])
def test_any_real_numbers_serve(dtype: str, write: Write) -> None:
    arrays = changed(values=np.array([1, 2, 3]).astype(dtype), sigma=np.array([1, 1, 1]).astype(dtype), channels=None)
    samples = read(write(saved(arrays)))
    assert samples.values.tolist() == [[1.0], [2.0], [3.0]]
    assert samples.channels == ("value",)


def test_declarations_by_argument(write: Write) -> None:
    path = write(saved(changed(quantity=None, angle_unit=None)))
    samples = read(path, quantity="reflectance_factor", angle_unit="degrees")
    assert samples.values[0, 0].item() == pytest.approx(1.25 / np.pi)
    with pytest.raises(FormatError, match=r"quantity to be declared .* Add it to the archive") as caught:
        read(path, angle_unit="degrees")
    assert caught.value.field == "quantity"
    with pytest.raises(FormatError, match="angle_unit to be declared") as caught:
        read(path, quantity="brdf")
    assert caught.value.field == "angle_unit"
    with pytest.raises(FormatError, match="angle_unit to be 'degrees' as the file has it, got 'radians'"):
        read(write(saved(npz_arrays())), angle_unit="radians")
    with pytest.raises(UnknownNameError, match="quantity to be a known name, got 'radiance'"):
        read(write(saved(changed(quantity=np.array("radiance")))))


def test_radians(write: Write) -> None:
    angles = {name: np.deg2rad(npz_arrays()[name]) for name in ("theta_i", "phi_i", "theta_o", "phi_o")}
    samples = read(write(saved(changed(**angles, angle_unit=np.array("radians")))))
    assert torch.equal(samples.wi, read(write(saved(npz_arrays()))).wi)


def test_rows_at_the_horizon_are_masked(write: Write) -> None:
    samples = read(write(saved(changed(theta_o=np.array([45.0, 90.0, 20.0])))))
    assert samples.masked == (Masked("a direction is at the horizon, where no BRDF can be measured", 1),)
    assert len(samples) == 2


@pytest.mark.parametrize(
    ("changes", "words", "field"),
    [
        ({"phi_o": None}, "either wi and wo, or theta_i, phi_i, theta_o and phi_o, got theta_i, phi_i, theta_o.", "wi"),
        ({"wi": np.ones((3, 3))}, "got wi, theta_i, phi_i, theta_o, phi_o. Save one of the two sets.", "wi"),
        ({"values": None}, "the archive to hold values, got none", "values"),
        ({"values": np.ones((3, 2, 2))}, "values to be of shape (N, C) or (N,) with at least one sample", "values"),
        ({"values": np.ones((0, 2))}, "with at least one sample, got (0, 2)", "values"),
        ({"values": np.float64(1)}, "with at least one sample, got ()", "values"),
        ({"phi_i": np.zeros(2)}, "phi_i to be of shape (3,) as values has 3 rows, got (2,)", "phi_i"),
        ({"weight": np.ones((3, 1))}, "weight to be of shape (3,)", "weight"),
        ({"sigma": np.ones(3)}, "sigma to be of shape (3, 2) as values has 3 rows, got (3, 1)", "sigma"),
        ({"values": np.array([1, np.nan, 3]), "sigma": None}, "values to be finite, got [nan] at row 1", "values"),
        ({"phi_i": np.array([1, 2, np.inf])}, "phi_i to be finite, got inf at row 2 (counted from 0)", "phi_i"),
        ({"theta_i": np.array([10.0, 91.0, 0.0])}, "theta_i to be at most 90 degrees", "theta_i"),
        ({"sigma": np.zeros((3, 2))}, "sigma to be positive and finite, got 0 at row 0 (counted from 0)", "sigma"),
        ({"channels": np.array(["a"])}, "channels to be 2 names as values has 2 columns, got 1", "channels"),
        ({"comment": np.array("x")}, "keys to be among wi, wo, theta_i, phi_i, theta_o, phi_o, values,", "comment"),
        ({"values": np.array(["a", "b", "c"])}, "values to be an array of real numbers, got <U1. Save it as", "values"),
        ({"values": np.ones(3, complex)}, "values to be an array of real numbers, got complex128", "values"),
        ({"values": np.ones(3, bool)}, "values to be an array of real numbers, got bool", "values"),
        ({"weight": np.ones(3, np.longdouble)}, "weight to be an array of real numbers, got float128", "weight"),
        ({"quantity": np.array(1.0)}, "quantity to be an array of text, got float64. Save it as str.", "quantity"),
        ({"quantity": np.array(["brdf", "brdf"])}, "quantity to be one word, got an array of shape (2,)", "quantity"),
        ({"weight": np.array([None, 1, 2])}, "weight to be an array of real numbers, got object", "weight"),
    ],
)
def test_bad_archives_are_refused_by_key(changes: dict[str, object], words: str, field: str, write: Write) -> None:
    with pytest.raises((FormatError, SamplesError)) as caught:
        read(write(saved(changed(**changes))))
    assert words in str(caught.value)
    assert caught.value.field == field


class Harmful:
    """Leaves a trace if it is ever unpickled."""

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return (Path.touch, (Path("harmed"),))


def test_pickles_are_never_loaded(write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    arrays = changed(channels=np.array([Harmful()], dtype=object))
    with pytest.raises(FormatError, match="channels to be an array of text, got object"):
        read(write(saved(arrays)))
    bare = pickle.dumps(Harmful())
    with pytest.raises(FormatError, match="a readable NumPy archive, got ValueError"):
        read(write(zipped([("values.npy", bare)])))
    assert not Path("harmed").exists()


def test_a_bomb_is_refused_by_the_directory(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(npz, "MAX_UNCOMPRESSED_BYTES", 100_000)
    content = saved(changed(values=np.zeros(100_000), sigma=None))
    assert len(content) < 10_000
    with pytest.raises(FormatError, match=r"at most 100,000 bytes unpacked, got 80\d,\d{3}\. Split it"):
        read(write(content))


def test_the_limit_is_two_gibibytes() -> None:
    assert npz.MAX_UNCOMPRESSED_BYTES == 8 * _size.MOST_NUMBERS == 2**31


def test_small_types_count_as_the_numbers_that_they_become(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    """An array of bytes takes eight times as much once it is read."""
    monkeypatch.setattr(_size, "MOST_NUMBERS", 21)
    content = saved(changed(sigma=None, theta_i=np.zeros(3, np.int8)))
    assert len(read(write(content))) == 3  # of four angles, a weight and two channels
    monkeypatch.setattr(_size, "MOST_NUMBERS", 20)
    with pytest.raises(FormatError, match=r"a file of at most 20 numbers, got 21\. Split it"):
        read(write(content))


def test_names_of_channels_without_end_are_refused(write: Write) -> None:
    with pytest.raises(FormatError, match=r"Expected channels to be at most 10,000 words, got 10,001\. Save one name"):
        read(write(saved(changed(channels=np.full(10_001, "a")))))


def test_a_header_that_claims_more_than_it_holds_is_refused(write: Write) -> None:
    lying = npy(np.ones(3)).replace(b"(3,)", b"(9876543210987,)")
    lying = lying[:8] + (int.from_bytes(lying[8:10], "little") + 12).to_bytes(2, "little") + lying[10:]
    with pytest.raises(FormatError, match=r"values to hold 79,012,345,687,896 bytes as its header says .*, got 24\."):
        read(write(zipped([("values.npy", lying)])))


def test_a_key_saved_twice_is_refused(write: Write) -> None:
    with pytest.warns(UserWarning, match="Duplicate name"):
        content = zipped([("values.npy", npy(np.ones(3))), ("values.npy", npy(np.zeros(3)))])
    with pytest.raises(FormatError, match="every key of the archive to be there once, got 'values' twice"):
        read(write(content))


def test_a_member_that_is_no_array_is_refused(write: Write) -> None:
    for content in (
        zipped([("values.npy", b"")]),
        zipped([("values.npy", b"\x93NUMPY\x09\x00")]),
        b"PK\x03\x04 nothing",
    ):
        with pytest.raises(FormatError, match=r"Expected a readable NumPy archive, got .*The file is damaged"):
            read(write(content), format="npz")
