"""Margins from frequency-response data, each with its range."""
