"""Parquet, for large sets: a table whose columns are named as those of a CSV file are.

    theta_i_deg, phi_i_deg, theta_o_deg, phi_o_deg  or  wi_x .. wo_z     any integer or floating type
    value, or r, g, b, or one column a wavelength in nm; sigma, weight, cell as in CSV
    schema metadata: quantity, angle_unit, azimuth_observed               or as arguments

A null among the values is an empty cell. The number of cells is checked in the footer before any data are read, and the
types of the columns with it. Needs the extra `arrow`.
"""

from pathlib import Path

from ..errors import FormatError
from ._arrow import check_schema, guarded, pyarrow, samples_from_table, table_of
from ._format import Format
from ._size import check_numbers
from .samples import Samples

MAGIC = b"PAR1"
_LARGEST_TEXT = 2**20  # bytes of any text in the footer


def sniff(head: bytes) -> bool:
    """Whether the file begins as Parquet files do."""
    return head.startswith(MAGIC)


def read(path: Path, quantity: str | None, angle_unit: str | None) -> Samples:
    """The samples of a Parquet file, values in 1/sr; FormatError or SamplesError names the column at fault."""
    parquet = pyarrow("pyarrow.parquet")
    try:
        with parquet.ParquetFile(
            path,
            pre_buffer=False,
            thrift_string_size_limit=_LARGEST_TEXT,
            thrift_container_size_limit=_LARGEST_TEXT,
            arrow_extensions_enabled=False,
        ) as file:
            about = file.metadata
            check_schema(file.schema_arrow)
            groups = [about.row_group(k) for k in range(about.num_row_groups)]
            rows = sum(group.num_rows for group in groups)
            if rows != about.num_rows or any(group.num_rows < 0 for group in groups):
                raise FormatError(
                    f"Expected the row groups to hold {about.num_rows:,} rows as the footer says, got {rows:,}. "
                    "The file is damaged: fetch it again."
                )
            check_numbers(rows * about.num_columns)
            # the sizes that row groups claim bound what decompression may take
            chunks = [group.column(k) for group in groups for k in range(group.num_columns)]
            check_numbers(sum(max(chunk.total_uncompressed_size, 0) for chunk in chunks) // 8)
            table = file.read(use_threads=False)
    except Exception as error:
        raise guarded("Parquet", error) from error
    return samples_from_table(table, path, "parquet", quantity, angle_unit)


def write_parquet(samples: Samples, path: Path) -> None:
    """None; writes all that `read` gives back, bit for bit."""
    table = table_of(samples)
    pyarrow("pyarrow.parquet").write_table(table, path, compression="zstd")


FORMAT = Format(
    name="parquet",
    description="Parquet: the columns of a CSV file, quantity and angle_unit in the schema's metadata",
    sniff=sniff,
    read=read,
    suffix=".parquet",
    write=write_parquet,
)
