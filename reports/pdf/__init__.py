"""Reports as PDF for signing, typeset by typst from the same document as the page."""

from reports.pdf.typeset import pdf_bytes, write_pdf

__all__ = ["pdf_bytes", "write_pdf"]
