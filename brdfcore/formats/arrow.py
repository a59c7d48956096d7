"""Arrow IPC, as a file (also called Feather) or a stream: a table whose columns are named as those of a CSV file are.

Columns, metadata and nulls are as in Parquet (parquet.py). Needs the extra `arrow`.

A file is read as the stream that it holds, message by message. A compressed message may unpack to any size, and pyarrow
would only say so afterwards: so what its buffers claim is added up first, from the message's own table of them (a
flatbuffer: Message.header is a RecordBatch, whose `buffers` have an offset and a length in the body; a compressed
buffer begins with its unpacked length, or -1 where it is stored as it is).
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..errors import FormatError
from ._arrow import check_schema, guarded, pyarrow, samples_from_table, table_of
from ._format import Format
from ._size import check_numbers
from .samples import Samples

MAGIC = b"ARROW1"  # twice zero after it, to eight bytes
STREAM = b"\xff\xff\xff\xff"  # and the length of the schema's message
_LONGEST_SCHEMA = 2**20  # bytes; another number after STREAM is another format's
_HEADER, _BUFFERS, _COMPRESSION = 2, 2, 3  # fields of Message and of RecordBatch


def sniff(head: bytes) -> bool:
    """Whether the file begins as Arrow's files or streams do."""
    return head.startswith(MAGIC + b"\0\0") or (
        head.startswith(STREAM) and 0 < int.from_bytes(head[4:8], "little") <= _LONGEST_SCHEMA
    )


def read(path: Path, quantity: str | None, angle_unit: str | None) -> Samples:
    """The samples of an Arrow file or stream, values in 1/sr; FormatError or SamplesError names the column at fault."""
    arrow = pyarrow("pyarrow")
    try:
        with arrow.memory_map(str(path)) as source:
            if source.read(len(MAGIC)) == MAGIC:
                _check_end(source)
            else:
                source.seek(0)
            schema = arrow.ipc.read_schema(arrow.ipc.read_message(source))
            check_schema(schema)
            table = arrow.Table.from_batches(_batches(arrow, source, schema), schema=schema)
            return samples_from_table(table, path, "arrow", quantity, angle_unit)
    except Exception as error:
        raise guarded("Arrow", error) from error


def _check_end(source: Any) -> None:
    """Raise FormatError where an Arrow file does not end as it begins; leave `source` at its first message."""
    source.seek(source.size() - len(MAGIC))
    if source.read(len(MAGIC)) != MAGIC:
        raise FormatError(
            "Expected a readable Arrow file, got one that does not end as it begins. It is truncated: fetch it again."
        )
    source.seek(len(MAGIC) + 2)


def _batches(arrow: Any, source: Any, schema: Any) -> Iterator[Any]:
    """The record batches after the schema, each checked before it is unpacked and after."""
    rows = 0
    while True:
        try:
            message = arrow.ipc.read_message(source)
        except EOFError:
            return
        check_numbers(_unpacked_bytes(message) // 8)
        batch = arrow.ipc.read_record_batch(message, schema)
        rows += batch.num_rows
        check_numbers(rows * batch.num_columns)
        batch.validate(full=True)
        yield batch


def _unpacked_bytes(message: Any) -> int:
    """What the buffers of a message take once they are unpacked."""
    metadata, body = memoryview(message.metadata), memoryview(message.body)
    batch = _table(metadata, _field(metadata, _table(metadata, 0), _HEADER))
    if not _field(metadata, batch, _COMPRESSION):
        return len(body)
    at = _table(metadata, _field(metadata, batch, _BUFFERS))
    (count,) = struct.unpack_from("<I", metadata, at)
    total = 0
    for offset, length in struct.iter_unpack("<qq", metadata[at + 4 : at + 4 + 16 * count]):
        if length:
            (unpacked,) = struct.unpack_from("<q", body, offset)
            total += length if unpacked < 0 else unpacked
    return total


def _table(buffer: memoryview, at: int) -> int:
    """Where the table, or the vector, lies to which the number at `at` points."""
    return at + int(struct.unpack_from("<I", buffer, at)[0])


def _field(buffer: memoryview, table: int, slot: int) -> int:
    """Where a field of a table lies; 0 where it is absent."""
    slots = table - struct.unpack_from("<i", buffer, table)[0]
    size = struct.unpack_from("<H", buffer, slots)[0]
    offset = struct.unpack_from("<H", buffer, slots + 4 + 2 * slot)[0] if 4 + 2 * slot < size else 0
    return int(table + offset) if offset else 0


def write_arrow(samples: Samples, path: Path) -> None:
    """None; writes all that `read` gives back, bit for bit."""
    table, arrow = table_of(samples), pyarrow("pyarrow")
    with arrow.OSFile(str(path), "wb") as sink, arrow.ipc.new_file(sink, table.schema) as writer:
        writer.write_table(table)


FORMAT = Format(
    name="arrow",
    description="Arrow IPC file or stream (Feather): the columns of a CSV file, declarations in the schema's metadata",
    sniff=sniff,
    read=read,
    suffix=".arrow",
    write=write_arrow,
)
