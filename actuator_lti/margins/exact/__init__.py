"""Rational loops in exact arithmetic on their doubles: roots, crossings, what the data determine."""
