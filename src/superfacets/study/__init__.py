"""What compares and reproduces: rivals, the Princeton benchmark, the figures of the paper."""
