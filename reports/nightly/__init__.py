"""Nightly builds: a cache of results, a history of every figure, and a static site made from it."""
