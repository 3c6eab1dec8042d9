"""Label meshes region by region in a browser, with a local web server that stores work files.

The labels of a cell (face, point or tetrahedron) are a class and an object. Regions only help to
select cells, so a new segmentation does not change labels.
"""
