"""Random and mutated frames at a live emulator, and the judge who says whether it still does what the standards allow."""
