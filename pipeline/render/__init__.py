"""Films and pictures of a trajectory, drawn off screen."""
