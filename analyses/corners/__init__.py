"""The drive at its corners: hot, cold, low supply, and the worst ends of its tolerances."""

from analyses.corners.result import Asked, Corner, Corners
from analyses.corners.run import corners

__all__ = ["Asked", "Corner", "Corners", "corners"]
