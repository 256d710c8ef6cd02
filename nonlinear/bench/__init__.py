"""The drive under an instrument: loops opened, a motion, and the derivative of the running drive on it."""
