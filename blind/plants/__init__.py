"""Plants that are withheld from the diagnosis: the physics of its candidates in other formulations."""

from drivetwin.blind.plants.formulations import FORMULATIONS, LIBRARY, has_formulations, plant_of

__all__ = ["FORMULATIONS", "LIBRARY", "has_formulations", "plant_of"]
