"""What the page needs to follow a change of the design by itself: keys, how the row follows from them, text."""

from reports.live.model import live_model

__all__ = ["live_model"]
