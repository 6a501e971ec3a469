"""A run with its mode sequence as a chain of smooth steps and jumps that can be differentiated."""
