"""`python -m spook_tracker` is the command `tracker`."""

from spook_tracker.tracker.cli.main import main

if __name__ == "__main__":
    main(prog_name="tracker")
