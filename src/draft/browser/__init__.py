"""Robots that walk under live physics in a web page, without a server."""
