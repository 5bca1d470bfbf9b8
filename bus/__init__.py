"""The bus: how a program reaches one, how a frame is written in a log, and what frames cost on a physical one."""
