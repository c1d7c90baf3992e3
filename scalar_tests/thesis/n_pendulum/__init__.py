"""A chain of many links that falls from the horizontal."""
