"""Runs a case: a virtual machine on a bus, the controller as a process, and a record of both."""
