"""What foreign files are imported from: one format a file."""
