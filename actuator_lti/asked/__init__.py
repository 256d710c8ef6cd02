"""What can be required of a drive, where each figure is read, and the three words for it."""
