"""The single-arm SCARA wafer handler of docs/wafer-handler.md: kinematics, dynamics, moves of the blade."""
