"""Arrow IPC, as a file (also called Feather) or a stream: a table whose columns are named as those of a CSV file are.

Columns, metadata and nulls are as in Parquet (parquet.py). Needs the extra `arrow`.
"""

from pathlib import Path

from ._arrow import check_schema, check_size, guarded, pyarrow, samples_from_table, table_of
from ._format import Format
from .samples import Samples

MAGIC = b"ARROW1\0\0"
STREAM = b"\xff\xff\xff\xff"  # and the length of the schema's message
_LONGEST_SCHEMA = 2**20  # bytes; another number after STREAM is another format's


def sniff(head: bytes) -> bool:
    """Whether the file begins as Arrow's files or streams do."""
    return head.startswith(MAGIC) or (
        head.startswith(STREAM) and 0 < int.from_bytes(head[4:8], "little") <= _LONGEST_SCHEMA
    )


def read(path: Path, quantity: str | None, angle_unit: str | None) -> Samples:
    """The samples of an Arrow file or stream, values in 1/sr; FormatError or SamplesError names the column at fault."""
    arrow = pyarrow("pyarrow")
    try:
        with path.open("rb") as opened:
            is_file = opened.read(len(MAGIC)) == MAGIC
        with arrow.memory_map(str(path)) as source:
            reader = arrow.ipc.open_file(source) if is_file else arrow.ipc.open_stream(source)
            check_schema(reader.schema)
            batches, rows = [], 0
            for batch in (reader.get_batch(k) for k in range(reader.num_record_batches)) if is_file else reader:
                rows += batch.num_rows
                check_size(rows, batch.num_columns)
                batch.validate(full=True)
                batches.append(batch)
            table = arrow.Table.from_batches(batches, schema=reader.schema)
            return samples_from_table(table, path, "arrow", quantity, angle_unit)
    except Exception as error:
        raise guarded("Arrow", error) from error


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
