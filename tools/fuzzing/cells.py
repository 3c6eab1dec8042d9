def check_cells(rng, folder):
    pass


def check_work_file(rng, folder):
    pass


def check_manifest(rng, folder):
    pass
