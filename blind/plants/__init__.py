"""Plants that are withheld from the diagnosis: the physics of its candidates in other formulations."""

from blind.plants.formulations import FORMULATIONS, plant_of

__all__ = ["FORMULATIONS", "plant_of"]
