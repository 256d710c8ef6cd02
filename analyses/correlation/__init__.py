"""The model against measured records: what it says for their own command, and how far off it is."""
