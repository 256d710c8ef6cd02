"""Loops with exact delays: form, certified intervals."""
