"""Checks an effect, built-in or external, against the contract of effects: plant, prediction, search, file."""

from drivetwin.emulator.conformance.findings import Finding, findings

__all__ = ["Finding", "findings"]
