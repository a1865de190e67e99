"""From a block to an FMU, in Python or native, and what an FMU says about itself."""
