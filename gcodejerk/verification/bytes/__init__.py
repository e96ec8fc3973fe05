"""Both files byte by byte: what was kept, what stands in a rapid's place, and what may."""
