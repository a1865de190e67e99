"""Logs of robots and measuring systems: several sources in one file, each with a clock of its own."""
