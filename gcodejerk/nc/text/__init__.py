"""Text: from the bytes of a file to blocks and words, with nothing lost and nothing meant.

`chunks` cuts a file at line ends; `lexer` reads all plain lines of a chunk at once, `tokenizer` one
line with every byte accounted for.
"""
