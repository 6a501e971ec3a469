"""Analyses beyond a single run: sensitivities, modes, sweeps, calibration."""
