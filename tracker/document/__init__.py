"""One run as a document: the only shape results travel in."""
