"""Runs and steps by the compiled run-time of FMUs, inside this process."""
