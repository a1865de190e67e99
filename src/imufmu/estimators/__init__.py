"""One estimator, one file, or a folder where it has parts."""
