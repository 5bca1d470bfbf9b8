"""What all analyses of recordings share: one low-pass filter, and the torque that a measured motion needs."""
