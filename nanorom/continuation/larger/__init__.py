"""Orbits of a modal model as the equations of more modes see them: what the model is wrong by."""
