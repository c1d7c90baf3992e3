"""Pages, charts, feed and files."""
