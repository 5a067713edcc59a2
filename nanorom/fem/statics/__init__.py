"""Static states under loads, and the paths that lead there."""
