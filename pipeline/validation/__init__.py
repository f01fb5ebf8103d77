"""The simulated torso beside published physiology: runs, verdicts and the page of them."""
