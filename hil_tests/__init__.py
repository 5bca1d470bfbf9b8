"""The acceptance suite that a bench runs against a controller release: not built yet."""
