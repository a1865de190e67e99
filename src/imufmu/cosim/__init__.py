"""Co-simulation: a system description (SSP) or a recording in, results out."""
