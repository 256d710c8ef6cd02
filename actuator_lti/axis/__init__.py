"""A loop of factors on the axis, compiled: bounds over intervals, crossings, the smallest distance to -1.

The room of the kernels; `actuator_lti.margins.axis_search` calls them.
"""
