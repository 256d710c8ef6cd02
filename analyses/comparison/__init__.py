"""Variants of a design against their base."""
