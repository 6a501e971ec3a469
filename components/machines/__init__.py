"""Electrical machines and servo drives."""
