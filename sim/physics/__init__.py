"""Arrays in, arrays out: the physics of the torso, without MuJoCo."""
