"""The wire between one drive and the bus: frames, and who may disturb them."""
