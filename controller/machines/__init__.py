"""What a controller knows of a machine before it meets it: drawings, limits, its own model. None of it is measured."""
