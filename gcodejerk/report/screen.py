"""Tables on a screen of any width.

Rule: no number and no word is ever broken. Columns of text are wrapped between words; where that is
not enough, columns are left out in an order that the table states, then from the right, and a line
below says which.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich import box
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderableType
from rich.table import Table
from rich.text import Text

GAP, EDGES = 3, 2
"""Between two columns, and at both ends."""
NARROWEST = 16
"""To which a column of text is wrapped, unless a word is longer."""

Cell = str | Text


class ScreenTable:
    """A table without frame, its head underlined; as much of it as there is room for.

    Parameters
    ----------
    *columns : tuple of str
        Title, which may have two lines, and ``left`` or ``right``.
    wrap : sequence of str
        Titles of columns of text.
    drop : sequence of str
        Titles of columns that can be done without, the first one first. The first column stays.
    """

    def __init__(
        self, *columns: tuple[str, str], wrap: Sequence[str] = (), drop: Sequence[str] = ()
    ) -> None:
        self.titles = [title for title, _ in columns]
        self.justify = [justify for _, justify in columns]
        self.wrapped = {self.titles.index(title) for title in wrap}
        self.drop = [self.titles.index(title) for title in drop]
        self.rows: list[list[Text]] = []

    def add_row(self, *cells: Cell) -> None:
        """Put a row below the others; what is not given is empty."""
        texts = [cell if isinstance(cell, Text) else Text(cell) for cell in cells]
        self.rows.append(texts + [Text("")] * (len(self.titles) - len(texts)))

    def __rich_console__(
        self, console: Console, options: ConsoleOptions
    ) -> Iterator[RenderableType]:
        shown, widths = self._fitting(options.max_width)
        table = Table(box=box.SIMPLE_HEAD, pad_edge=False, header_style="bold")
        for k in shown:
            table.add_column(
                Text(self.titles[k]),
                justify=self.justify[k],  # type: ignore[arg-type]
                overflow="fold",
                width=widths[k],
                no_wrap=k not in self.wrapped,
            )
        for row in self.rows:
            table.add_row(*(row[k] for k in shown))
        yield table
        left_out = [
            " ".join(title.split())
            for k, title in enumerate(self.titles)
            if k not in shown and title
        ]
        if left_out:
            said = f"for want of room without: {', '.join(left_out)}"
            yield Text(said, style="dim")

    def _fitting(self, room: int) -> tuple[list[int], dict[int, int]]:
        """Columns to show, and how wide each is."""
        natural = [self._width(k, "\n") for k in range(len(self.titles))]
        least = [
            min(natural[k], max(self._width(k, None), NARROWEST)) if k in self.wrapped else width
            for k, width in enumerate(natural)
        ]
        shown = list(range(len(self.titles)))
        for k in [*self.drop, *(j for j in shown[:0:-1] if j not in self.drop)]:
            if _total([least[j] for j in shown]) <= room:
                break
            shown.remove(k)
        widths = {k: natural[k] for k in shown}
        for k in sorted(self.wrapped & set(shown), key=lambda k: -natural[k]):
            over = _total(list(widths.values())) - room
            widths[k] = max(least[k], natural[k] - max(over, 0))
        return shown, widths

    def _width(self, k: int, separator: str | None) -> int:
        """Of the longest line of a column, or of its longest word."""
        texts = [self.titles[k], *(row[k].plain for row in self.rows)]
        return max(cell_len(part) for text in texts for part in (text.split(separator) or [""]))


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + GAP * (len(widths) - 1) + EDGES
