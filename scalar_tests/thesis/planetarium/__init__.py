"""A planet on a slightly eccentric orbit."""
