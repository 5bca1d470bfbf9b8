"""The formats of foreign files, one per file."""
