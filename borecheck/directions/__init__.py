"""Which needle directions to a target are clear, proven over continuous cells."""
