"""Least-squares identification of friction, inertia and offset from recordings."""

from drivetwin.identification.identify import identify
from drivetwin.identification.result import AxisIdentification, Identification, Parameter, Truth
from drivetwin.identification.settings import Settings
from drivetwin.identification.write import write_results
from drivetwin.motion.inverse_dynamics import Model, load_model

__all__ = [
    "AxisIdentification",
    "Identification",
    "Model",
    "Parameter",
    "Settings",
    "Truth",
    "identify",
    "load_model",
    "write_results",
]
