"""Designs that are best: free parameters within bounds, limits, load cases, choices from tables, Pareto fronts."""
