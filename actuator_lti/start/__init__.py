"""What starting up costs nothing for: names, packages and kernels loaded on first use."""
