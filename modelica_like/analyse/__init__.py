"""What a symbolic model is for beyond its trajectory: sensitivities, modes, sweeps, calibration."""
