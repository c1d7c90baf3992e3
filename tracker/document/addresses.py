"""Where the website has what: for those who show it and those who point to it, never for those who judge."""

from __future__ import annotations

from .wording import slug


def page_of(test: str) -> str:
    """The page of the website about a test, from the website's root."""
    return f"tests/{slug(test)}.html"
