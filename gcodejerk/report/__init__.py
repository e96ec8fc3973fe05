"""Reports: what was done to a program or a move, as JSON and as tables for a terminal."""
