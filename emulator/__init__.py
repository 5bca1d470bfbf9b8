"""The virtual machine: CANopen drives whose loops move a MuJoCo plant with true friction."""
