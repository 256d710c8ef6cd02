"""The linear writing of a drive (model.md section 8): plant, blocks, wiring, signals, operating facts.

Everything works for one design, or for many at once: a design whose numbers are arrays of shape (K,).
"""
