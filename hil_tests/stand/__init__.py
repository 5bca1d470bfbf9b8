"""Where a case takes place: a virtual machine on a bus, the controller as a process, and what is noted of both."""
