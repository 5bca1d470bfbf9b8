"""Effects that the library lacks, one a file: of these a diagnosis has to say that it does not know them."""

from blind.foreign.base import Axis, Foreign, Influence, Scale
from blind.foreign.chatter import Chatter
from blind.foreign.counterbalance import Counterbalance
from blind.foreign.dropouts import Dropouts
from blind.foreign.fan import Fan
from blind.foreign.jamming import Jamming
from blind.foreign.pulses import Pulses
from blind.foreign.slosh import Slosh
from blind.foreign.tether import Tether
from blind.foreign.wandering_cogging import WanderingCogging
from blind.foreign.wind import Wind

__all__ = ["FOREIGN_EFFECTS", "Axis", "Foreign", "Influence", "Scale"]

FOREIGN_EFFECTS: dict[str, type[Foreign]] = {
    effect.name: effect
    for effect in (Chatter, Counterbalance, Dropouts, Fan, Jamming, Pulses, Slosh, Tether, WanderingCogging, Wind)
}
"""By their names."""
