"""A language server: editors ask it about netlists and sizing files while they are written."""
