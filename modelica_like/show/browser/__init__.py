"""A drive as one page that computes it in a browser."""
