"""The drive outside of Python: the running one as C99 or as an FMU, the linear one as state spaces."""
