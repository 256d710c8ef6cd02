"""Measured frequency responses: what is known of them at the points and between."""
