"""What do we ask of an engine? One file is one physical question whose answer is a number with a unit."""
