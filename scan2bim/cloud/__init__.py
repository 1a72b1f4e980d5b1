"""Points on disk, panoramas, surfels: what reading leaves for the later stages."""
