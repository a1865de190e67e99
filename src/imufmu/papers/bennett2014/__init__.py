"""The experiments of Bennett, Jafari, Gans 2014: motions, runs, figures, and what must come out."""
