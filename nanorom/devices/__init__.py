"""Many devices instead of one: grids and samples of scenes."""
