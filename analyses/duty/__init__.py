"""A duty cycle against the continuous current: rms, overload protection, winding temperature."""

from actuator_lti.start.on_first_use import from_rooms

__getattr__, __dir__ = from_rooms(__name__, asked="Asked", run="Duty Heating Overload duty")
