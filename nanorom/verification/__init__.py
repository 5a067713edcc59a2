"""Full-order periodic orbits of the film, and what a modal model leaves out."""
