"""Charts as data, and their SVG: drawn once here, kept live on the page by ``templates/page``."""
