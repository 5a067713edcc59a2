"""What leaves the finite elements: model, force patterns, triangulations."""
