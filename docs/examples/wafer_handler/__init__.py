"""What `make wafer-handler` is made of, a file a question."""
