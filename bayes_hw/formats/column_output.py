"""Writing columns of numbers as CSV, MATLAB, HDF5 or Parquet, by the ending of the path."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.files import temporary_sibling, write_csv


def write_columns(
    path: Path,
    columns: Mapping[str, FloatArray],
    attributes: Mapping[str, str],
    units: Mapping[str, str],
) -> None:
    """Write columns of equal length under their names; `read_columns` gives them back to the last digit.

    `.mat` is a MATLAB file of version 5 with column vectors, `.h5`, `.hdf5` and `.hdf` an HDF5 file and
    `.parquet` and `.pq` a Parquet file, both with `attributes` and the `units` of their columns; anything
    else is CSV. Raises InputError where the folder cannot be written, or where Parquet is asked for without
    pyarrow.
    """
    match path.suffix.lower():
        case ".mat":
            from scipy import io

            with temporary_sibling(path) as temporary:
                io.savemat(temporary, dict(columns), oned_as="column", do_compression=True)
        case ".h5" | ".hdf5" | ".hdf":
            from bayes_hw.formats.hdf5_output import hdf5_written_atomically

            with hdf5_written_atomically(path) as file:
                file.attrs.update(attributes)
                for name, values in columns.items():
                    data = file.create_dataset(name, data=values, compression="gzip", shuffle=True)
                    data.attrs["units"] = units[name]
        case ".parquet" | ".pq":
            from bayes_hw.formats.parquet_file import pyarrow_parquet

            parquet = pyarrow_parquet(path)
            table = _arrow_table(columns, attributes, units)
            with temporary_sibling(path) as temporary:
                parquet.write_table(table, temporary, compression="zstd")
        case _:
            write_csv(path, columns)


def _arrow_table(
    columns: Mapping[str, FloatArray], attributes: Mapping[str, str], units: Mapping[str, str]
) -> object:
    import pyarrow

    fields = [pyarrow.field(name, pyarrow.float64(), metadata={"units": units[name]}) for name in columns]
    schema = pyarrow.schema(fields, metadata={"bayes_hw": json.dumps(dict(attributes))})
    return pyarrow.table([np.asarray(v, dtype=np.float64) for v in columns.values()], schema=schema)
