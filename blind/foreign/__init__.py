"""Effects that the library lacks, one a file: of these a diagnosis has to say that it does not know them."""

from drivetwin.blind.foreign.base import Axis, Foreign, Influence, Scale
from drivetwin.blind.foreign.chatter import Chatter
from drivetwin.blind.foreign.counterbalance import Counterbalance
from drivetwin.blind.foreign.dropouts import Dropouts
from drivetwin.blind.foreign.fan import Fan
from drivetwin.blind.foreign.jamming import Jamming
from drivetwin.blind.foreign.pulses import Pulses
from drivetwin.blind.foreign.slosh import Slosh
from drivetwin.blind.foreign.tether import Tether
from drivetwin.blind.foreign.wandering_cogging import WanderingCogging
from drivetwin.blind.foreign.wind import Wind

__all__ = ["FOREIGN_EFFECTS", "Axis", "Foreign", "Influence", "Scale"]

FOREIGN_EFFECTS: dict[str, type[Foreign]] = {
    effect.name: effect
    for effect in (Chatter, Counterbalance, Dropouts, Fan, Jamming, Pulses, Slosh, Tether, WanderingCogging, Wind)
}
"""By their names."""
