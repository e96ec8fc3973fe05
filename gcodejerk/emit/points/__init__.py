"""Emitters of rows and points for motion controllers: files of their own, one module a controller.

Each module tells what its controller makes of the numbers, where that is written, and how far it
can be trusted. Marks: M the maker's documentation, S the project's own source, R a third party's
page, U nobody could verify it for us. What is U is no live line until the machine file confirms it.
"""
