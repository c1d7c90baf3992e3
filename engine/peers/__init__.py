"""Other engines, a file each. Only `engine.find` imports them; each imports its own engine, an optional extra."""
