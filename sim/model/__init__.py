"""Builders: each adds its part to the torso."""
