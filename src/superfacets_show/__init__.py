"""Colors of regions, pictures, and HTML pages."""
