"""What became better or worse, and since which commit."""
