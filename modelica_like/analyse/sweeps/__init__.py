"""Many runs of one model: grids and samples, workers, checkpoints, global sensitivity."""
