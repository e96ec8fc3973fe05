"""Profiles: the motions themselves, as segments of constant jerk, in closed form.

What a profile is (`profiles`), and the families that need no search: symmetric ones and the
control's own, the paper's Conditions, boxes behind a step. Which profile leaves a machine still is
searched next door, in `motion.search`.
"""
