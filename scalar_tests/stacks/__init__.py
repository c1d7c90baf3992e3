"""What stands or leans by its weight, or falls to a heap."""
