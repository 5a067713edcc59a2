"""Step II: vibration modes, their peaks, names and errors."""
