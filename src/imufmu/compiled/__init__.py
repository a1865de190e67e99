"""From a block to C, and from C to libraries and programs."""
