"""Strategies and checks for users' own property tests (needs the extra `testing`: hypothesis).

    from gcodejerk.testing import assert_stream_valid, machines, moves, programs
"""
