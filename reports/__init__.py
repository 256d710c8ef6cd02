"""Reports for people and machines: one JSON document, and the pages, figures and tables made of it."""
