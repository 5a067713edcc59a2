"""Special points: found, confirmed, and branches that leave there."""
