"""Work that falls into parts: study files, samples, and where they are computed."""
