"""One plant, one file, or a folder where it has parts."""
