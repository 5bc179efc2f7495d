"""Results folders in the formats of other programs: relign-export. Reading and writing need the standard library only."""
