"""How results are drawn with matplotlib and shown in a notebook."""
