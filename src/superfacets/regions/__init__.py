"""Stage 5: who touches whom, and the clean-up of regions."""
