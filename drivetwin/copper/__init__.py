"""What frames cost on copper: their bits, the load they make, and who waits for whom."""
