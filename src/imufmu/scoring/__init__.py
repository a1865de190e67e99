"""Errors of an estimate against the truth, and what a system's results contain."""
