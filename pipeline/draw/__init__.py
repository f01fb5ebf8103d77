"""Arrays to figures; every figure is the text of an SVG file."""
