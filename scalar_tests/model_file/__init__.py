"""Questions put to a model file, which has no closed form."""
