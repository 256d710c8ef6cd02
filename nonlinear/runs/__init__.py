"""One run, or many at once: checked, called, wrapped, reduced."""
