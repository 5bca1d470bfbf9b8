"""The wire between one drive and the bus: frames, and the faults that disturb them."""
