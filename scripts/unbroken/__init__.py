"""What no mishap may break: a long run with random faults, killed processes, disks that fail, clients that misbehave."""
