"""A box on a plane that is tilted in any direction."""
