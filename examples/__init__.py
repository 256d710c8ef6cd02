"""Examples that run; each is a test in tests/export."""
