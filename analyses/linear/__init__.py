"""All that is said of the linear loops of a design in one place."""
