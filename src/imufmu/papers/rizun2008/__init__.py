"""The experiments of Rizun 2008: motions, runs, figures, and what must come out."""
