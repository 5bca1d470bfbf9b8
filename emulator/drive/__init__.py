"""CiA 402: a servo drive behind a CANopen device. One file a mode of operation."""
