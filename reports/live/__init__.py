"""What a page needs to follow a change of the design: keys, how the row follows from them, text."""
