"""What every judge of a recording needs: the one low-pass filter, and the torque that a measured motion needs."""
