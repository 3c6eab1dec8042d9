"""Materials, images, colors of faces, and images of labels."""
