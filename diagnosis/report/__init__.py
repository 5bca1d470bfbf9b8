"""What is told: gap, shares, causes, the patched simulation, as values, files and a page."""
