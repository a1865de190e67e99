"""The experiments of Lee, Choi 2018: motions, runs, figures, and what must come out."""
