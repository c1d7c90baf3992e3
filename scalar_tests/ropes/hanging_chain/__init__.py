"""A hanging chain with a heavy load: taut strings and what they ask of a time step."""
