"""The experiments of Lee, Park, Robinovitch 2012: motions, runs, figures, and what must come out."""
