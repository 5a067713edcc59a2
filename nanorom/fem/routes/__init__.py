"""From a scene to modes and tensors, one route for each kind of model."""
