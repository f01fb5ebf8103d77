"""From recordings to fitted breaths, tables and reports."""
