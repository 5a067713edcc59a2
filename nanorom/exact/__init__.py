"""Solutions that use no finite elements."""
