"""A design as the row of numbers that the compiled kernels read."""
