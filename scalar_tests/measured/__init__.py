"""Scenes that somebody has measured: whether the model is right about the world, not only the solver about the model."""
