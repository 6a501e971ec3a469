"""Steady states of drives, and curves of them."""
