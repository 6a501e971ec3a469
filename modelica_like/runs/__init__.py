"""Numbers read off runs: what is asked, and how it follows from dense output."""
