"""Acausal component models of drive-trains."""
