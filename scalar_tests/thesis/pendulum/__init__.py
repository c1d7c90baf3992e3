"""A bob on a distance constraint."""
