"""The problems A01 to A05 of the library of computational benchmarks for multibody dynamics."""
