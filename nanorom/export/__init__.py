"""Modal systems in the formats of other programs."""
