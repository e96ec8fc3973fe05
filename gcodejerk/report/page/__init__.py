"""The report that people look at: one HTML page with everything in it, that asks no network."""

SUFFIX = ".html"
"""By this, in upper or lower case, a report is known as a page."""
