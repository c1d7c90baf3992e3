"""What floats and sinks."""
