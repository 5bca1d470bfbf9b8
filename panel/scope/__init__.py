"""The scope: channels of the bus or of the plant's truth, kept in rings, triggered, decimated for the page, saved."""
