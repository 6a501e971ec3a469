"""Shafts: couplings, absorbers, joints, losses, loads, sources and sensors."""
