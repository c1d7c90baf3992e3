"""What holds, slides, rolls and sorts by friction."""
