"""Control files: curves of time that say what muscles, back and larynx do."""
