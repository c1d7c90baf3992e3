"""The scalar tests of Sundling's thesis (2016), and grids of the same slope."""
