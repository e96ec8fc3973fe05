"""Hosts: what is installed into the programs that run our output, and taken out again."""
