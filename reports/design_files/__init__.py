"""What is asked about design files: which are shipped, which keys there are, one to start from."""
