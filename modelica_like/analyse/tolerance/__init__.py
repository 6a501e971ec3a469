"""What tolerances of parameters do to outputs of a run: to first order, and by sampling."""
