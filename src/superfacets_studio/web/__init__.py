"""Web server of the studio: address, security checks, requests and replies."""
