"""A beam of boxes held by locks, on two piles."""
