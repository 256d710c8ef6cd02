"""Loops with exact delays: form, poles by collocation, certified intervals."""
