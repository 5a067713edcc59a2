"""One periodic orbit: equations, solutions, stability."""
