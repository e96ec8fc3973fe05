"""Drilling cycles written out: what they mean, told a second time, and the proof of it."""
