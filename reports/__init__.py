"""Reports for people and machines: one JSON document, and the pages, figures and tables made of it.

``reports.report(design, "out")`` is the command ``actuator-lti report``.
"""

from actuator_lti.start.on_first_use import from_rooms

__getattr__, __dir__ = from_rooms(__name__, build="report")
