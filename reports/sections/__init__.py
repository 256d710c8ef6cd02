"""Sections of a report: each turns results into plain data, and draws nothing."""
