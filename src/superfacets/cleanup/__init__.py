"""Functions of labels that return labels. Stage 5 of `segment` smooths and resizes regions."""
