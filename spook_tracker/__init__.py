"""One name for everything that is installed: `engine`, `scalar_tests` and `tracker` live below it.

Physics engines have folders called engine and tracker of their own; beside them this distribution takes one
name only. The folders themselves stay at the top of the repository and are linked here.
"""
