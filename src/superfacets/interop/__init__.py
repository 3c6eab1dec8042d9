"""At home in other tools: results on their objects, and methods of their datasets."""
