"""What every room stands on: errors, files that appear whole, child processes, compiled functions, the page of a report."""
