"""Whether a drive comes to rest, and waiting that costs no work."""
