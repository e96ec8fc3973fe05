"""Studies: one move looked at from all sides, its amplitude map and its comparison."""
