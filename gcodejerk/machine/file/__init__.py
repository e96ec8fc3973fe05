"""Machine files: from the text to a description and back, every key in one table.

`document` reads YAML with places, `table` says what each key may hold, `checker` holds one against
the other, and `loader` makes a `Description` of the values; `writer` and `schema` go the other way.
"""
