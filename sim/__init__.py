"""Physics-based human torso: bones, soft cavities, muscles, lung."""
