"""Arms, hands and legs."""
