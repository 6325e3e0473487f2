"""Results and their HDF5 files: one module per kind of result; `file` writes and reads all of them."""
