"""Co-simulation: systems of FMUs that exchange signals at communication points; drives cut into such systems."""
