"""Read SSP: what a description and its parameter sets say, before any FMU is asked."""
