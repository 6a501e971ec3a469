"""Co-simulation: systems of FMUs that exchange signals at communication points, and drives cut into such systems."""
