"""One mass on one spring or one row: the studies of the thesis' chapter 2."""
