"""Results in words and on one page."""
