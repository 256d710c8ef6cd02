"""A duty cycle against the continuous current: rms, overload protection, winding temperature."""

from analyses.duty.result import Asked, Duty, Heating, Overload
from analyses.duty.run import duty

__all__ = ["Asked", "Duty", "Heating", "Overload", "duty"]
