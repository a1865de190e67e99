"""Files on disk: whole or not at all, archives that may be hostile, tables, and where our own lie."""
