"""The command `drivetwin`, and what every room of the house shares: errors, files, bus names, recordings."""
