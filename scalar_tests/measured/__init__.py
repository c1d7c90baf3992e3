"""Scenes with published measurements: whether the model is right about the world, not only the solver about the model."""
