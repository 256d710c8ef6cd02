"""What a drive does when a part of it fails: deflection, current and moment over time."""

from analyses.failures.result import Asked, FailureCase, Failures
from analyses.failures.run import failures

__all__ = ["Asked", "FailureCase", "Failures", "failures"]
