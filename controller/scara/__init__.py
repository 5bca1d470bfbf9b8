"""The single-arm SCARA wafer handler of docs/paper.md: kinematics, dynamics, moves of the blade."""
