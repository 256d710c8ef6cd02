"""Figures: each draws from the plain data of a report's JSON and computes nothing."""
