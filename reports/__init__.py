"""Reports for people and machines: one JSON document, and the pages, figures and tables made of it.

``reports.report(design, "out")`` is the command ``actuator-lti report``.
"""

from actuator_lti.start.on_first_use import on_first_use

_PUBLIC = {"report": "reports.build"}

__all__ = sorted(_PUBLIC)


__getattr__, __dir__ = on_first_use(__name__, _PUBLIC)
