"""Models as FMUs: export, import, run-time, checks."""
