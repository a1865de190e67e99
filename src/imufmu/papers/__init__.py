"""The papers' experiments, one folder each, and the verdict on their conclusions."""
