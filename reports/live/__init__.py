"""What a page needs to follow a change of the design: keys, how the row follows from them, text."""

from reports.live.model import live_model

__all__ = ["live_model"]
