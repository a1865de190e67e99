"""The papers' own experiments, one module each; imufmu.evaluate.validate lists and runs them."""
