"""Controls whose programs take streams that nobody has measured, and whose settings can be tuned.

Streams: the points are right whatever the control does: they lie on the rapid's own path and end at
its end. F is the mean speed of each block, so a control that holds it is in time. What was not
verified is whether it does: a control that reads blocks slower than one in 2 ms, smooths them, or
ramps between them moves later than planned, and shakes otherwise. Each form says so.

Settings: one file a family of controls, each with the facts' sources. What is only hearsay is
written as a comment that asks (`emit.sheets`).
"""
