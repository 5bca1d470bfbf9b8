"""The reference controller with one thing broken, one mutant a file."""
