"""File formats: columns of numbers in text, MATLAB, HDF5 and Parquet files, read within bounds."""
