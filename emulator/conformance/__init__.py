"""Holds any effect against what an effect is: its plant, its prediction, its search, its file; for those of others too."""

from drivetwin.emulator.conformance.findings import Finding, findings

__all__ = ["Finding", "findings"]
