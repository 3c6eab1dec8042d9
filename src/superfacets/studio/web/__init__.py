"""The web server: its address, security checks, requests and replies."""
