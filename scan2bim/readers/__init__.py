"""Readers: a file a format, all streamed.

    paths = find_inputs(["scans/"])
    for header in read_headers(paths[0]):
        for chunk in read_chunks(header):
            ...
"""
