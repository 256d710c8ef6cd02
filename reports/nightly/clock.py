"""Times as texts: UTC, ISO 8601, seconds."""

from __future__ import annotations

from datetime import UTC, datetime


def now() -> str:
    """Time of the clock, as ``2026-01-31T23:59:59Z``."""
    return datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def to_seconds(text: str) -> float:
    """Seconds since 1970 of such a text.

    Examples
    --------
    >>> to_seconds("1970-01-02T00:00:00Z")
    86400.0
    """
    return datetime.fromisoformat(text.replace("Z", "+00:00")).timestamp()
