"""Speed against peers: paired, interleaved, CPU time. Never part of the tests."""
