"""Measured records: reading them, counting every row, and putting two recorders on one clock."""
