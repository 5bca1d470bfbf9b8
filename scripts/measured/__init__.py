"""What `make measured` is made of, a file a question."""
