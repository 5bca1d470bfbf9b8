"""What every package uses: errors, files written completely or not at all, child processes, compiled functions, reports."""
