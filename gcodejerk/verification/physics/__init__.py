"""The points of streams: where they lie, how fast they follow each other, what they leave."""
