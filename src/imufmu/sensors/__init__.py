"""One sensor, one file."""
