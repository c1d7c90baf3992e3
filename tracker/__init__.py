"""What changed, and since which commit? Runs scalar tests, records them, judges them, publishes them."""
