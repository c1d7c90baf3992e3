"""What rebounds, once or a thousand times."""
