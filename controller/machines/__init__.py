"""What a controller knows of a machine in advance: drawings, limits, a nominal model. None of it is measured."""
