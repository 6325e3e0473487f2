"""Universal files (UFF): the blocks of the format, read and written."""
