"""A clamped steel beam: scene, statics, question."""
