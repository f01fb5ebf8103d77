"""A human skin: its shape for a subject, how it is laid over the torso, and how it follows."""
