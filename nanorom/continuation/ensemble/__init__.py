"""Many motions in time at once: over levels, frequencies and starts."""
