"""A door hung on more hinges than it needs."""
