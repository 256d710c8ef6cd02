"""From a path to text and plain values, and back: read within bounds, written whole or not at all."""
