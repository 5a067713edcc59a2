"""The wall: the reduced model and what follows from its arrays."""
