"""What `make paper` is made of, a file a question."""
