"""The live page: one HTML file that draws results in a browser, without a network or a server."""
