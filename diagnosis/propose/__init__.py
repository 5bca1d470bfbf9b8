"""Fast proposals: nominal parameters that may be off, and the best of every effect on every axis beside a set."""
