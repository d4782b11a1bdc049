"""One triangle mesh: its arrays, primitives, patches and enlarged forms."""
