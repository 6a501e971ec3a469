"""What shafts and slides have alike: inertias and masses, springs, sources, sensors, given motions."""
