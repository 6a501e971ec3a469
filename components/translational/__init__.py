"""Slides, and what turns rotation into translation: screws, wheels, linkages, winches."""
