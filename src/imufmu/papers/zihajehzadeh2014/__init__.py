"""The experiments of Zihajehzadeh et al. 2014: motions, runs, figures, and what must come out."""
