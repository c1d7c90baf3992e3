"""A catalogue of one real test, for nights whose run times are scripted."""

from spook_tracker.scalar_tests.thesis import falling_object

CATALOGUE = {"falling_object": falling_object.TEST}
