"""Results as documents: JSON, text, and one self-contained HTML page."""
