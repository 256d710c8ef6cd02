"""Linear systems as matrices and names, with delays or without, and what is read from them at any point."""
