"""The page itself: its document, drawing, typography and renderings to HTML and PDF."""
