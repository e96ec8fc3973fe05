"""The interpreter: one block after the other changes the modal state, and rapids are entered.

`modal` owns the state, `execute` what a block does to it, `eligibility` which rapids can be
rewritten and why not, `rapids` the columns that come out. `runs` does the same to thousands of
plain lines at once. Which block comes next is not decided here, but in `nc.flow` and `nc.reader`.
"""
