"""What the controller can be told to do, one task a file (task/1)."""
