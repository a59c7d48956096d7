"""Arrow and Parquet: columns, declarations in the schema's metadata, nulls, limits, and their absence."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from format_cases import arrow_bytes, arrow_table, named_columns

from brdfcore.errors import FormatError, SamplesError
from brdfcore.formats import FORMATS, Masked, Samples, _size, read

pyarrow = pytest.importorskip("pyarrow")
ipc, parquet = pytest.importorskip("pyarrow.ipc"), pytest.importorskip("pyarrow.parquet")

Write = Callable[[bytes], Path]
KINDS = ("parquet", "arrow")


def save(table: object, kind: str, path: Path) -> Path:
    if kind == "parquet":
        parquet.write_table(table, path)
    else:
        with ipc.new_file(path, table.schema) as writer:  # type: ignore[attr-defined]
            writer.write_table(table)
    return path


def changed(**columns: object) -> object:
    return pyarrow.table({**named_columns(), **columns}).replace_schema_metadata({"quantity": "brdf"})


@pytest.mark.parametrize("kind", KINDS)
def test_columns_are_those_of_a_csv_file(kind: str, tmp_path: Path) -> None:
    samples = read(save(arrow_table(), kind, tmp_path / "x"))
    assert samples.format == kind
    assert samples.hash == Samples.from_angles(*named_columns().values(), "degrees").hash


def test_a_stream_is_read_too(write: Write) -> None:
    samples = read(write(arrow_bytes("new_stream")))
    assert samples.format == "arrow"
    assert samples.hash == read(write(arrow_bytes())).hash


@pytest.mark.parametrize("kind", KINDS)
def test_nulls_are_empty_cells(kind: str, tmp_path: Path) -> None:
    path = save(changed(value=pyarrow.array([1.0, None, 3.0])), kind, tmp_path / "x")
    samples = read(path)
    assert samples.masked == (Masked("a value's cell is empty", 1),)
    assert samples.values[:, 0].tolist() == [1.0, 3.0]
    with pytest.raises(FormatError, match=r"phi_i_deg at row 1 \(counted from 0\) to be a number, got an empty cell"):
        read(save(changed(phi_i_deg=pyarrow.array([1.0, None, 3.0])), kind, tmp_path / "x"))


@pytest.mark.parametrize("kind", KINDS)
def test_declarations_stand_in_the_metadata_or_are_arguments(kind: str, tmp_path: Path) -> None:
    columns = {name.removesuffix("_deg"): column for name, column in named_columns().items()}
    bare = pyarrow.table(columns)
    with pytest.raises(FormatError, match=r"quantity to be declared .* Add it to the schema's metadata") as caught:
        read(save(bare, kind, tmp_path / "x"))
    assert caught.value.field == "quantity"
    whole = bare.replace_schema_metadata({"quantity": "brdf_cos", "angle_unit": "degrees", "azimuth_observed": "true"})
    samples = read(save(whole, kind, tmp_path / "x"))
    assert samples.quantity == "brdf_cos"
    assert samples.azimuth_declared is True
    assert samples.hash == read(save(bare, kind, tmp_path / "x"), quantity="brdf_cos", angle_unit="degrees").hash
    with pytest.raises(FormatError, match="quantity to be text"):
        read(save(bare.replace_schema_metadata({"quantity": b"\xff"}), kind, tmp_path / "x"))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("dtype", ["int16", "uint64", "float16", "float32", "double"])
def test_any_real_type_serves(kind: str, dtype: str, tmp_path: Path) -> None:
    values = pyarrow.array(np.array([1, 2, 3]).astype(dtype if dtype != "double" else "f8"))
    assert read(save(changed(value=values), kind, tmp_path / "x")).values[:, 0].tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("columns", "words", "field"),
    [
        ({"value": ["a", "b", "c"]}, "value to be a column of real numbers, got string. Save it as double", "value"),
        ({"value": [[1.0], [2.0], [3.0]]}, "got list<", "value"),
        ({"value": [True, False, True]}, "got bool", "value"),
        ({"value": [1.0, float("inf"), 3.0]}, "value to be finite, got inf at row 1 (counted from 0)", "value"),
        ({"value": [1.0, float("nan"), 3.0]}, "value to be finite, got nan at row 1", "value"),
        ({"temperature": [1.0, 2.0, 3.0]}, "a known name, got 'temperature'", "temperature"),
        ({"theta_i_deg": [10.0, 95.0, 10.0]}, "theta_i to be at most 90 degrees", "theta_i"),
    ],
)
def test_bad_tables_are_refused_by_column(
    kind: str, columns: dict[str, object], words: str, field: str, tmp_path: Path
) -> None:
    with pytest.raises((FormatError, SamplesError)) as caught:
        read(save(changed(**columns), kind, tmp_path / "x"))
    assert words in str(caught.value)
    assert caught.value.field == field


@pytest.mark.parametrize("kind", KINDS)
def test_an_empty_table_is_refused(kind: str, tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="at least one row of data"):
        read(save(arrow_table().slice(0, 0), kind, tmp_path / "x"))


@pytest.mark.parametrize("kind", KINDS)
def test_large_tables_are_refused_before_they_are_read(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_size, "MOST_NUMBERS", 14)
    with pytest.raises(FormatError, match=r"a file of at most 14 numbers, got 1[57]"):
        read(save(arrow_table(), kind, tmp_path / "x"))


@pytest.mark.parametrize("compression", ["lz4", "zstd"])
@pytest.mark.parametrize("kind", ["new_file", "new_stream"])
def test_compressed_messages_are_read(kind: str, compression: str, tmp_path: Path) -> None:
    table = pyarrow.concat_tables([arrow_table()] * 400).combine_chunks()
    options = ipc.IpcWriteOptions(compression=compression)
    with getattr(ipc, kind)(tmp_path / "x", table.schema, options=options) as writer:
        writer.write_table(table, max_chunksize=500)
    assert read(tmp_path / "x").values[:, 0].tolist() == [12.5, 0.25, 0.125] * 400


@pytest.mark.parametrize("kind", ["new_file", "new_stream"])
def test_a_bomb_is_refused_before_it_is_unpacked(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    count = 2_000_000
    monkeypatch.setattr(_size, "MOST_NUMBERS", 1_000_000)
    table = pyarrow.table({**dict.fromkeys(("wi_x", "wi_y", "wo_x", "wo_y"), np.zeros(count)), "value": np.ones(count)})
    table = table.append_column("wi_z", [np.ones(count)]).append_column("wo_z", [np.ones(count)])
    with getattr(ipc, kind)(tmp_path / "x", table.schema, options=ipc.IpcWriteOptions(compression="zstd")) as writer:
        writer.write_table(table)
    assert (tmp_path / "x").stat().st_size < 30_000
    del table
    before = pyarrow.default_memory_pool().bytes_allocated()
    monkeypatch.setattr(ipc, "read_record_batch", lambda *_: pytest.fail("it was unpacked"))
    with pytest.raises(FormatError, match=r"a file of at most 1,000,000 numbers, got 14,000,000\."):
        read(tmp_path / "x")
    assert pyarrow.default_memory_pool().bytes_allocated() <= before


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_files_are_refused(kind: str, tmp_path: Path) -> None:
    path = save(arrow_table(), kind, tmp_path / "x")
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(FormatError, match=rf"(?i)a readable {kind} file, got .* truncated: fetch it again\."):
        read(path)


def test_a_stream_that_breaks_off_is_refused(write: Write) -> None:
    with pytest.raises(FormatError, match=r"a readable Arrow file, got \w+ .*The file is damaged or truncated"):
        read(write(arrow_bytes("new_stream")[:-100]))


@pytest.mark.parametrize("kind", KINDS)
def test_without_pyarrow_a_sentence_says_how_to_get_it(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = save(arrow_table(), kind, tmp_path / "x")
    for name in ("pyarrow", "pyarrow.parquet"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(FormatError, match=r"pyarrow to be installed, .* pip install 'brdfcore\[arrow\]'\."):
        read(path)


@pytest.mark.parametrize("kind", KINDS)
def test_channels_that_would_not_read_back_are_not_written(kind: str, tmp_path: Path) -> None:
    samples = Samples(torch.tensor([[0.0, 0.0, 1.0]]), torch.tensor([[0.0, 0.0, 1.0]]), [[1.0, 2.0]], ("ir", "uv"))
    write = FORMATS[kind].write
    assert write is not None
    with pytest.raises(FormatError, match="channels to be value, or r, g, b, or wavelengths in nm for a table, got"):
        write(samples, tmp_path / "x")
