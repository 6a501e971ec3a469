"""Small motions about a point: linear models, modes, frequency response."""
