"""The tasks of the controller, one per file (task/1)."""
