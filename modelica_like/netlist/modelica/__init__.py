"""Modelica text: read as components, and written from them."""
