"""Parts of an air circuit as they are described: valves, tubes, sources, regulators."""
