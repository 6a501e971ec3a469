"""Pages about component types in Markdown, made from their declarations."""
