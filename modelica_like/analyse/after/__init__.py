"""What is read off a run afterwards: load spectra, damage, duty, orders, step responses."""
